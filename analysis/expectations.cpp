#include "analysis/expectations.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace shiftrig::analysis {

namespace {

std::string text(double value) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.6g", value);
    return buffer;
}

std::string seconds(double value) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.3f s", value);
    return buffer;
}

std::string range(double minimum, double maximum) {
    if (std::isinf(minimum)) return "at most " + text(maximum);
    if (std::isinf(maximum)) return "at least " + text(minimum);
    return "from " + text(minimum) + " to " + text(maximum);
}

std::string during(const io::Window& window) {
    if (std::isinf(window.until)) return window.from > 0 ? " from " + seconds(window.from) + " on" : "";
    return " from " + seconds(window.from) + " to " + seconds(window.until);
}

bool inside(const io::Window& window, double time) {
    return time >= window.from && time <= window.until;
}

class Judge {
  public:
    Judge(const io::ScenarioFile& scenario, const Run& run, const Scorecard& card)
        : scenario_(scenario), run_(run), card_(card) {}

    std::vector<std::string> judge() {
        const auto& expected = scenario_.expect;
        if (expected.shifts_given) judge_shifts();
        for (const auto& limit : expected.metrics) judge_metric(limit);
        for (const auto& event : expected.events) judge_event(event);
        for (const auto& bound : expected.signals) judge_signal(bound);
        return std::move(broken_);
    }

  private:
    void broken(int line, int column, const std::string& what) {
        broken_.push_back(io::InputError(scenario_.path, line, column, what).what());
    }

    // Exactly these shifts, in this order, completed or not as written.
    void judge_shifts() {
        const auto& wanted = scenario_.expect.shifts;
        const auto& found = card_.shifts;
        for (std::size_t i = 0; i < std::max(wanted.size(), found.size()); ++i) {
            if (i >= found.size()) {
                broken(wanted[i].line, wanted[i].column,
                       "shift " + wanted[i].shift + " expected; the run ended at " +
                           seconds(run_.time.empty() ? 0 : run_.time.back()) + " without it");
                continue;
            }
            const Shift& shift = found[i].shift;
            const std::string at = "shift " + shift.label() + " at " + seconds(shift.asked_at);
            if (i >= wanted.size())
                broken(
                    wanted.empty() ? scenario_.expect.no_shifts_line : wanted.back().line,
                    wanted.empty() ? 0 : wanted.back().column,
                    at + " found; none expected" + (wanted.empty() ? "" : " after " + wanted.back().shift));
            else if (shift.label() != wanted[i].shift)
                broken(wanted[i].line, wanted[i].column, at + " found; expected " + wanted[i].shift);
            else if (shift.completed() != wanted[i].completed)
                broken(wanted[i].line, wanted[i].column,
                       at + " " + std::string(name(shift.end)) + "; expected " +
                           (wanted[i].completed ? "completed" : "not completed"));
        }
    }

    void judge_metric(const io::MetricLimit& limit) {
        bool any = false;
        for (const auto& score : card_.shifts) {
            if (!limit.shift.empty() && score.shift.label() != limit.shift) continue;
            const Metric* metric = score.find(limit.metric);
            if (metric == nullptr || !metric->value) continue;
            any = true;
            if (*metric->value >= limit.minimum && *metric->value <= limit.maximum) continue;
            broken(limit.line, limit.column,
                   score.shift.label() + " at " + seconds(score.shift.asked_at) + ": " + limit.metric +
                       " = " + text(*metric->value) + "; expected " + range(limit.minimum, limit.maximum));
        }
        if (!any)
            broken(limit.line, limit.column,
                   limit.metric + (limit.shift.empty() ? "" : " of " + limit.shift) +
                       ": no shift of the run has it");
    }

    void judge_event(const io::ExpectedEvent& expected) {
        const std::string what = expected.kind + (expected.device.empty() ? "" : " of " + expected.device);
        for (const auto& change : run_.changes) {
            if (change.kind != expected.kind ||
                (!expected.device.empty() && change.device != expected.device) ||
                !inside(expected.window, change.event.time))
                continue;
            if (!expected.must)
                broken(expected.line, expected.column,
                       what + " must not happen" + during(expected.window) + "; found " + change.text);
            return;
        }
        if (expected.must)
            broken(expected.line, expected.column,
                   what + " must happen" + during(expected.window) + "; it did not");
    }

    void judge_signal(const io::SignalBound& bound) {
        const int line = bound.quantity.line, column = bound.quantity.column;
        const auto* values = run_.column(bound.quantity.signal);
        if (values == nullptr || values->empty())
            return broken(line, column, bound.quantity.written + ": the run has no such signal");
        const auto check = [&](std::size_t row) {
            const double value = (*values)[row];
            if (value >= bound.minimum && value <= bound.maximum) return true;
            const double f = bound.quantity.factor;
            broken(line, column,
                   "at " + seconds(run_.time[row]) + ": " + bound.quantity.written + " = " + text(value / f) +
                       "; expected " + range(bound.minimum / f, bound.maximum / f) +
                       (bound.at_end() ? " in the end" : during(bound.window)));
            return false;
        };
        if (bound.at_end()) {
            check(values->size() - 1);
            return;
        }
        bool any = false;
        for (std::size_t row = 0; row < values->size(); ++row) {
            if (!inside(bound.window, run_.time[row])) continue;
            any = true;
            if (!check(row)) return;  // the first instant tells enough
        }
        if (!any)
            broken(line, column, bound.quantity.written + ": the run has no tick" + during(bound.window));
    }

    const io::ScenarioFile& scenario_;
    const Run& run_;
    const Scorecard& card_;
    std::vector<std::string> broken_;
};

}  // namespace

std::vector<std::string> broken_expectations(const io::ScenarioFile& scenario, const Run& run,
                                             const Scorecard& card) {
    return Judge(scenario, run, card).judge();
}

int count_expectations(const io::Expectations& e) {
    return static_cast<int>((e.shifts_given ? std::max<std::size_t>(1, e.shifts.size()) : 0) +
                            e.metrics.size() + e.events.size() + e.signals.size());
}

}  // namespace shiftrig::analysis
