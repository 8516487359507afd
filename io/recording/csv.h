// Comma-separated values: a header of names with units (`clutch.F1.pressure_command_pa`), one row a tick,
// numbers written as short as they can be without losing a bit; `nan` and `inf` as such.
#pragma once

#include <cstdio>
#include <span>
#include <string>
#include <vector>

#include "io/recording/reader.h"
#include "plant/signal.h"

namespace shiftrig::io {

// A name as it leaves the program.
std::string column_name(const plant::Signal& signal);

class CsvWriter {
  public:
    // First column: `time_s`. Throws RecordingError if the file cannot be created. "-" is standard output.
    CsvWriter(const std::string& path, const std::vector<plant::Signal>& columns);
    ~CsvWriter();
    CsvWriter(const CsvWriter&) = delete;
    CsvWriter& operator=(const CsvWriter&) = delete;

    // The parts of one row, as many values in all as columns.
    void begin_row(double time);
    void add(std::span<const double> values);
    void end_row();
    // Throws RecordingError if not everything could be written.
    void close();

  private:
    std::string path_, line_;
    std::FILE* file_ = nullptr;
    bool failed_ = false;
};

// Every tick of a recording: inputs, outputs, the rig's own. Returns the number of rows; how the recording
// ended is the reader's to say.
std::int64_t export_csv(RecordingReader& reader, const std::string& path);

}  // namespace shiftrig::io
