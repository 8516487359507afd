#include "io/recording/field.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <set>
#include <sstream>

#include "io/input_error.h"
#include "io/signals.h"
#include "io/text_file.h"
#include "io/units.h"

namespace shiftrig::io {

namespace {

std::vector<std::string> cells(const std::string& line, char separator) {
    std::vector<std::string> parts(1);
    for (const char c : line) {
        if (c == separator)
            parts.emplace_back();
        else if (c != '\r' && c != '"')
            parts.back() += c;
    }
    return parts;
}

const plant::Signal* signal_named(const std::vector<plant::Signal>& signals, const std::string& name) {
    const auto found =
        std::find_if(signals.begin(), signals.end(), [&](const auto& s) { return s.name == name; });
    return found == signals.end() ? nullptr : &*found;
}

// The column's value at a time between its rows.
double at(const FieldRecording& recording, const FieldColumn& column, double time, bool hold) {
    const auto& t = recording.time;
    const auto after = std::upper_bound(t.begin(), t.end(), time) - t.begin();
    const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, after - 1));
    if (hold || i + 1 >= t.size()) return column.value[i];
    const double share = (time - t[i]) / (t[i + 1] - t[i]);
    return column.value[i] + std::clamp(share, 0.0, 1.0) * (column.value[i + 1] - column.value[i]);
}

// The mass that a measured speed belongs to; empty if it is no speed of a mass.
std::string mass_of(const std::string& signal, const plant::Description& machine) {
    if (!signal.ends_with(".speed")) return "";
    if (signal.starts_with("mass.")) return signal.substr(5, signal.size() - 11);
    for (const auto& sensor : machine.sensors)
        if (signal == "sensor." + sensor.name + ".speed") return sensor.mass;
    return "";
}

void check_unit(const FieldRecording& recording, const FieldColumn& column, const plant::Signal& signal) {
    if (column.unit == signal.unit) return;
    throw InputError(recording.path, 1, 0,
                     column.written + " must be written with its unit: " + signal.name + " ends in " +
                         suffixes_of(signal.unit));
}

std::size_t rows_beyond(const plant::Signal& input, const FieldColumn& column) {
    return static_cast<std::size_t>(
        std::count_if(column.value.begin(), column.value.end(),
                      [rule = rule_of(input)](double value) { return !rule.holds(value); }));
}

}  // namespace

FieldColumn field_column(const std::string& written) {
    FieldColumn column;
    column.written = column.signal = written;
    if (const auto* spelling = unit_spelling(written); spelling && spelling->unit) {
        column.signal = written.substr(0, written.size() - spelling->suffix.size());
        column.unit = *spelling->unit;
        column.factor = spelling->factor;
    }
    return column;
}

FieldRecording read_field_csv(const std::string& path) {
    std::istringstream file(read_text(path));
    std::string line;
    if (!std::getline(file, line)) throw InputError(path, 0, 0, "is empty");
    const char separator = line.find(';') != std::string::npos    ? ';'
                           : line.find('\t') != std::string::npos ? '\t'
                                                                  : ',';
    const auto header = cells(line, separator);
    if (header[0] != "time_s")
        throw InputError(path, 1, 1, "the first column is \"" + header[0] + "\"; must be time_s");
    if (header.size() < 2) throw InputError(path, 1, 1, "has no column beside time_s");
    FieldRecording recording;
    recording.path = path;
    for (std::size_t i = 1; i < header.size(); ++i) {
        recording.columns.push_back(field_column(header[i]));
    }
    for (int number = 2; std::getline(file, line); ++number) {
        if (line.empty() || line == "\r") continue;
        const auto row = cells(line, separator);
        if (row.size() != header.size())
            throw InputError(
                path, number, 0,
                std::to_string(row.size()) + " values; the header has " + std::to_string(header.size()));
        for (std::size_t i = 0; i < row.size(); ++i) {
            char* end = nullptr;
            const double value = std::strtod(row[i].c_str(), &end);
            if (row[i].empty() || *end != '\0' || !std::isfinite(value))
                throw InputError(path, number, 0, header[i] + " = \"" + row[i] + "\"; must be a number");
            if (i > 0)
                recording.columns[i - 1].value.push_back(value * recording.columns[i - 1].factor);
            else if (!recording.time.empty() && value <= recording.time.back())
                throw InputError(path, number, 1,
                                 "time_s = " + row[i] + "; must be later than the row before");
            else
                recording.time.push_back(value);
        }
    }
    if (recording.time.size() < 2) throw InputError(path, 0, 0, "has fewer than two rows");
    return recording;
}

FieldFit replay_field(const FieldRecording& recording, const plant::Model& model,
                      const std::vector<std::string>& locked) {
    struct Driven {
        const FieldColumn* column;
        std::size_t input;
        bool hold;
        double minimum, maximum;
    };
    struct Measured {
        const FieldColumn* column;
        std::size_t output;
        double sum_of_squares = 0;
        std::size_t count = 0;
    };
    FieldFit result;
    std::vector<Driven> driven;
    std::vector<Measured> measured;
    plant::Start start;
    start.locked = locked;
    std::vector<std::pair<std::string, double>> measured_speeds;
    std::set<std::string> seen;
    for (const auto& column : recording.columns) {
        const bool known = model.input(column.signal) >= 0 || model.output(column.signal) >= 0;
        if (known && !seen.insert(column.signal).second)
            throw InputError(recording.path, 1, 0,
                             column.written + ": a column before it is of the same signal");
        if (const int input = model.input(column.signal); input >= 0) {
            const plant::Signal& signal = *signal_named(model.inputs(), column.signal);
            check_unit(recording, column, signal);
            const bool hold = signal.unit == plant::Unit::one;
            driven.push_back(
                {&column, static_cast<std::size_t>(input), hold, signal.minimum, signal.maximum});
            result.driven.push_back(column.written);
            if (const std::size_t rows = rows_beyond(signal, column))
                result.limited.push_back({column.written, rows, rule_of(signal, column.factor).words()});
        } else if (const int output = model.output(column.signal); output >= 0) {
            const plant::Signal& signal = *signal_named(model.outputs(), column.signal);
            check_unit(recording, column, signal);
            measured.push_back({&column, static_cast<std::size_t>(output)});
            Fit fit;
            fit.written = column.written;
            fit.unit = signal.unit;
            result.fits.push_back(fit);
            if (const std::string mass = mass_of(column.signal, model.description()); !mass.empty())
                measured_speeds.emplace_back(mass, column.value.front());
        } else {
            result.ignored.push_back(column.written);
        }
    }
    if (measured.empty())
        throw InputError(recording.path, 1, 0,
                         "no column is an output of the model, so there is nothing to hold it against");

    plant::Operators operators(model);
    plant::State state(model);
    plant::Inputs inputs(model);
    plant::Outputs outputs(model);
    plant::Scratch scratch(model);
    const auto drive = [&](double time) {
        for (const auto& d : driven)
            inputs.value[d.input] = std::clamp(at(recording, *d.column, time, d.hold), d.minimum, d.maximum);
    };
    drive(recording.time.front());
    // Measured speeds of masses that are rigidly coupled never agree to the bit: the first of them counts.
    plant::start(model, state, start, inputs);
    for (const auto& speed : measured_speeds) {
        plant::Start more = start;
        more.speeds.push_back(speed);
        try {
            plant::start(model, state, more, inputs);
            start = more;
        } catch (const plant::ModelError&) {
        }
    }
    plant::start(model, state, start, inputs);

    // Rows that fall into a step are held against its two ends, interpolated.
    const double begin = recording.time.front(), h = model.step_size();
    const auto steps = static_cast<std::int64_t>(std::floor((recording.time.back() - begin) / h + 0.5));
    if (steps < 1)
        throw InputError(recording.path, 0, 0,
                         "lasts " + in_digits(recording.time.back() - begin) +
                             " s, less than half a step of " + in_digits(h) + " s: nothing can be compared");
    plant::observe(model, operators, state, inputs, outputs, scratch);
    std::vector<double> before = outputs.value;
    std::size_t row = 0;
    for (std::int64_t n = 0; n < steps; ++n) {
        const double from = begin + static_cast<double>(n) * h, to = begin + static_cast<double>(n + 1) * h;
        drive(from);
        plant::step(model, operators, state, inputs, outputs, scratch);
        for (; row < recording.time.size() && recording.time[row] <= to + 1e-9 * h; ++row) {
            const double share = std::clamp((recording.time[row] - from) / h, 0.0, 1.0);
            for (std::size_t i = 0; i < measured.size(); ++i) {
                Measured& m = measured[i];
                const double simulated =
                    before[m.output] + share * (outputs.value[m.output] - before[m.output]);
                const double apart = simulated - m.column->value[row];
                m.sum_of_squares += apart * apart;
                Fit& fit = result.fits[i];
                if (m.count++ > 0 && std::abs(apart) <= fit.worst) continue;
                fit.worst = std::abs(apart);
                fit.worst_time = recording.time[row];
                fit.simulated = simulated;
                fit.measured = m.column->value[row];
            }
        }
        before = outputs.value;
    }
    for (std::size_t i = 0; i < measured.size(); ++i)
        result.fits[i].rms = std::sqrt(measured[i].sum_of_squares /
                                       static_cast<double>(std::max<std::size_t>(1, measured[i].count)));
    return result;
}

}  // namespace shiftrig::io
