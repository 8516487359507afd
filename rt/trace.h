// A trace of what the loop did when, for ui.perfetto.dev or chrome://tracing: spans are put into a ring
// that was allocated beforehand, the last `capacity` of them are written out after the run.
//
//     Trace trace(100'000);
//     const auto step = trace.name("step");                    // before the loop
//     trace.span(step, begin, end);                            // in the loop, times of the loop's clock
//     trace.write(file);                                       // after it
#pragma once

#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "rt/realtime.h"

namespace shiftrig::rt {

class Trace {
  public:
    using Name = std::int32_t;

    explicit Trace(std::size_t capacity) : ring_(capacity) {}

    // A kind of span; `row` groups kinds into rows (threads) of the picture.
    Name name(const std::string& text, const std::string& row = "plant");
    void span(Name name, std::int64_t begin, std::int64_t end, std::int64_t slot = -1) SHIFTRIG_REALTIME {
        if (ring_.empty()) return;
        ring_[static_cast<std::size_t>(count_ % static_cast<std::int64_t>(ring_.size()))] = {begin, end, slot,
                                                                                             name};
        ++count_;
    }

    std::int64_t count() const noexcept { return count_; }  // ever recorded
    std::int64_t overwritten() const noexcept;              // of these, no longer in the ring
    // Chrome's trace event format, complete events ("ph":"X"), microseconds since the first span kept.
    void write(std::ostream& out) const;

  private:
    struct Span {
        std::int64_t begin = 0, end = 0, slot = -1;  // [ns], [ns]
        Name name = 0;
    };
    struct Kind {
        std::string text;
        std::size_t row;
    };
    std::vector<Span> ring_;
    std::vector<Kind> kinds_;
    std::vector<std::string> rows_;
    std::int64_t count_ = 0;
};

}  // namespace shiftrig::rt
