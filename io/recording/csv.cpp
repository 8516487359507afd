#include "io/recording/csv.h"

#include <cerrno>
#include <charconv>
#include <cstring>

#include "io/recording/output_file.h"

namespace shiftrig::io {

namespace {

void append_number(std::string& line, double value) {
    char digits[32];
    const auto end =
        std::to_chars(digits, digits + sizeof digits, value).ptr;  // shortest that reads back the same
    line.append(digits, end);
}

}  // namespace

std::string column_name(const plant::Signal& signal) {
    return signal.name + std::string(plant::suffix(signal.unit));
}

CsvWriter::CsvWriter(const std::string& path, const std::vector<plant::Signal>& columns)
    : path_(path), file_(open_output(path)) {
    if (!file_) throw RecordingError(path + ": cannot be written: " + std::strerror(errno));
    line_ = "time_s";
    for (const auto& column : columns) line_ += "," + column_name(column);
    end_row();
}

CsvWriter::~CsvWriter() {
    if (file_ && file_ != stdout) std::fclose(file_);
}

void CsvWriter::begin_row(double time) {
    append_number(line_, time);
}

void CsvWriter::add(std::span<const double> values) {
    for (const double value : values) {
        line_ += ',';
        append_number(line_, value);
    }
}

void CsvWriter::end_row() {
    line_ += '\n';
    failed_ |= std::fwrite(line_.data(), 1, line_.size(), file_) != line_.size();
    line_.clear();
}

void CsvWriter::close() {
    if (!file_) return;
    failed_ |= (file_ == stdout ? std::fflush(file_) : std::fclose(file_)) != 0;
    file_ = nullptr;
    if (failed_) throw RecordingError(path_ + ": cannot be written: " + std::strerror(errno));
}

std::int64_t export_csv(RecordingReader& reader, const std::string& path) {
    const Manifest& m = reader.manifest();
    std::vector<plant::Signal> columns = m.inputs;
    columns.insert(columns.end(), m.outputs.begin(), m.outputs.end());
    columns.insert(columns.end(), m.rig.begin(), m.rig.end());
    CsvWriter csv(path, columns);
    std::int64_t rows = 0;
    for (RecordedTick tick; reader.next(tick); ++rows) {
        csv.begin_row(1e-9 * static_cast<double>(tick.sim_time_ns));
        csv.add(tick.inputs);
        csv.add(tick.outputs);
        csv.add(tick.rig);
        csv.end_row();
    }
    csv.close();
    return rows;
}

}  // namespace shiftrig::io
