#include "io/signals.h"

#include <algorithm>
#include <stdexcept>

namespace shiftrig::io {

namespace {

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i;
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t substitute = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, substitute});
        }
    }
    return row[b.size()];
}

}  // namespace

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
    std::vector<std::pair<std::size_t, std::string>> ranked;
    for (const auto& known : signals_) ranked.emplace_back(edit_distance(name, known.name), known.name);
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::string> names;
    for (std::size_t i = 0; i < ranked.size() && i < static_cast<std::size_t>(count); ++i)
        names.push_back(ranked[i].second);
    return names;
}

}  // namespace shiftrig::io
