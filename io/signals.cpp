#include "io/signals.h"

#include <stdexcept>

#include "io/nearest.h"

namespace shiftrig::io {

Rule rule_of(const plant::Signal& signal, double factor) {
    constexpr double unlimited = 1e300;  // as plant::Signal has it
    Rule rule;
    if (signal.minimum > -unlimited) rule.minimum = signal.minimum / factor;
    if (signal.maximum < unlimited) rule.maximum = signal.maximum / factor;
    return rule;
}

int SignalTable::add(const plant::Signal& signal) {
    const int index = size();
    if (!index_.emplace(signal.name, index).second)
        throw std::invalid_argument("signal \"" + signal.name + "\" is declared twice");
    signals_.push_back(signal);
    value.push_back(signal.initial);
    return index;
}

int SignalTable::find(std::string_view name) const noexcept {
    const auto found = index_.find(name);
    return found == index_.end() ? -1 : found->second;
}

std::vector<std::string> SignalTable::nearest(std::string_view name, int count) const {
    std::vector<std::string> known;
    for (const auto& signal : signals_) known.push_back(signal.name);
    return io::nearest(name, known, static_cast<std::size_t>(count));
}

}  // namespace shiftrig::io
