#include "apps/rig/timeline.h"

#include <cmath>

namespace shiftrig::rig {

int find_settable(const io::SignalTable& signals, const std::vector<bool>& settable, const std::string& path,
                  const io::NamedQuantity& quantity) {
    const int index = signals.find(quantity.signal);
    if (index >= 0 && settable[static_cast<std::size_t>(index)]) return index;
    std::string near;
    for (const auto& name : signals.nearest(quantity.signal)) near += (near.empty() ? "" : ", ") + name;
    throw io::InputError(path, quantity.line, quantity.column,
                         index >= 0 ? quantity.written + " is an output; it cannot be set"
                                    : quantity.written + ": there is no such input; near it: " + near);
}

bool takes_whole_numbers(const std::string& signal) {
    return signal == "driver.lever";
}

void check_whole_numbers(const io::ScenarioFile& scenario) {
    const auto check = [&](const io::Setting& setting, double over) {
        const auto& quantity = setting.quantity;
        if (!takes_whole_numbers(quantity.signal)) return;
        const auto refuse = [&](const std::string& what) {
            throw io::InputError(scenario.path, quantity.line, quantity.column, what);
        };
        if (setting.value != std::floor(setting.value))
            refuse(quantity.written + " = " + io::in_digits(setting.value / quantity.factor) +
                   "; must be a whole number");
        if (over > 0) refuse(quantity.written + " takes whole numbers; with it over_s must be 0");
    };
    for (const auto& input : scenario.start.inputs) check(input, 0);
    for (const auto& moment : scenario.timeline) check(moment.setting, moment.over);
}

Timeline::Timeline(const io::ScenarioFile& scenario, const io::SignalTable& signals,
                   const std::vector<bool>& settable) {
    for (const auto& timed : scenario.timeline)
        entries_.push_back({std::llround(timed.at * 1e9), std::llround(timed.over * 1e9),
                            find_settable(signals, settable, scenario.path, timed.setting.quantity),
                            timed.setting.value});
}

void Timeline::apply(std::int64_t time_ns, io::SignalTable& signals) SHIFTRIG_REALTIME {
    const auto value_of = [&](const Entry& e) -> double& {
        return signals.value[static_cast<std::size_t>(e.signal)];
    };
    begun_ = next_;
    for (; next_ < entries_.size() && entries_[next_].at <= time_ns; ++next_) {
        Entry& e = entries_[next_];
        e.from = value_of(e);
    }
    for (std::size_t i = oldest_; i < next_; ++i) {
        Entry& e = entries_[i];
        if (e.done) continue;
        e.done = time_ns >= e.at + e.over;
        const double share = e.done ? 1 : static_cast<double>(time_ns - e.at) / static_cast<double>(e.over);
        value_of(e) = e.done ? e.value : e.from + (e.value - e.from) * share;
    }
    while (oldest_ < next_ && entries_[oldest_].done) ++oldest_;
}

}  // namespace shiftrig::rig
