#include "plant/check.h"

#include <cmath>
#include <cstdio>

#include "plant/plant.h"

namespace shiftrig::plant {

std::string number(double value) {
    char text[40];
    std::snprintf(text, sizeof text, "%.9g", value);
    return text;
}

Check::Check(std::string_view kind, const std::string& name) : kind_(kind), name_(name) {
    if (name.empty()) fail("name", "is empty; every device has a name");
}

void Check::fail(const std::string& field, const std::string& rule) const {
    throw ModelError(kind_, name_, field, rule);
}

void Check::rule(const char* field, double value, bool holds, const char* text) const {
    if (!std::isfinite(value) || !holds) fail(field, "= " + number(value) + "; must be " + text);
}

void Check::rising(const char* field, const std::vector<std::pair<double, double>>& table) const {
    if (table.size() < 2) fail(field, "has fewer than two points");
    for (std::size_t i = 0; i < table.size(); ++i) {
        any(field, table[i].first);
        any(field, table[i].second);
        if (i > 0 && !(table[i].first > table[i - 1].first)) {
            fail(field, "= " + number(table[i].first) + " after " + number(table[i - 1].first) +
                            "; its first column must rise");
        }
    }
}

void Check::waveform(const char* field, const Waveform& waveform) const {
    for (const Waveform::Piece& piece : waveform.pieces) {
        for (double value : {piece.offset, piece.slope, piece.amplitude, piece.frequency, piece.phase_time}) {
            any(field, value);
        }
        if (!(piece.from < piece.until)) fail(field, "has a piece that ends before it begins");
        if (piece.slope != 0 && piece.from < -1e299) fail(field, "has a slope without a start time");
    }
}

}  // namespace shiftrig::plant
