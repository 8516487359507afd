#include "rt/trace.h"

#include <algorithm>
#include <cstdio>

namespace shiftrig::rt {

namespace {

std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        if (static_cast<unsigned char>(c) >= 0x20) result += c;
    }
    return result + '"';
}

// 1234 ns → "1.234", exactly.
std::string microseconds(std::int64_t nanoseconds) {
    char text[40];
    std::snprintf(text, sizeof text, "%lld.%03lld", static_cast<long long>(nanoseconds / 1000),
                  static_cast<long long>(nanoseconds % 1000));
    return text;
}

}  // namespace

Trace::Name Trace::name(const std::string& text, const std::string& row) {
    auto place = std::find(rows_.begin(), rows_.end(), row);
    if (place == rows_.end()) place = rows_.insert(rows_.end(), row);
    kinds_.push_back({text, static_cast<std::size_t>(place - rows_.begin())});
    return static_cast<Name>(kinds_.size() - 1);
}

std::int64_t Trace::overwritten() const noexcept {
    return std::max<std::int64_t>(0, count_ - static_cast<std::int64_t>(ring_.size()));
}

void Trace::write(std::ostream& out) const {
    const std::int64_t first = overwritten();
    std::int64_t origin = 0;
    for (std::int64_t i = first; i < count_; ++i) {
        const Span& span = ring_[static_cast<std::size_t>(i % static_cast<std::int64_t>(ring_.size()))];
        origin = i == first ? span.begin : std::min(origin, span.begin);
    }
    out << "{\"displayTimeUnit\":\"ns\",\"otherData\":{\"overwritten\":" << first << "},\"traceEvents\":[";
    const char* separator = "\n";
    for (std::size_t row = 0; row < rows_.size(); ++row) {
        out << separator << R"({"ph":"M","name":"thread_name","pid":1,"tid":)" << row + 1
            << R"(,"args":{"name":)" << quoted(rows_[row]) << "}}";
        separator = ",\n";
    }
    for (std::int64_t i = first; i < count_; ++i) {
        const Span& span = ring_[static_cast<std::size_t>(i % static_cast<std::int64_t>(ring_.size()))];
        const Kind& kind = kinds_[static_cast<std::size_t>(span.name)];
        out << separator << R"({"ph":"X","name":)" << quoted(kind.text) << R"(,"pid":1,"tid":)"
            << kind.row + 1 << R"(,"ts":)" << microseconds(span.begin - origin) << R"(,"dur":)"
            << microseconds(std::max<std::int64_t>(0, span.end - span.begin));
        if (span.slot >= 0) out << R"(,"args":{"slot":)" << span.slot << "}";
        out << "}";
        separator = ",\n";
    }
    out << "\n]}\n";
}

}  // namespace shiftrig::rt
