// The known names nearest to a misspelt one, for error messages.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace shiftrig::io {

// Levenshtein distance: insertions, deletions and substitutions from a to b.
inline std::size_t edit_distance(std::string_view a, std::string_view b) {
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

// At most `count` names, nearest first, equal distances in alphabetical order.
inline std::vector<std::string> nearest(std::string_view name, const std::vector<std::string>& known,
                                        std::size_t count = 3) {
    std::vector<std::pair<std::size_t, std::string>> ranked;
    for (const auto& candidate : known) ranked.emplace_back(edit_distance(name, candidate), candidate);
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::string> names;
    for (std::size_t i = 0; i < std::min(count, ranked.size()); ++i) names.push_back(ranked[i].second);
    return names;
}

// "; nearest: disc", or nothing where nothing is known.
inline std::string nearest_hint(std::string_view name, const std::vector<std::string>& known) {
    const auto names = nearest(name, known, 1);
    return names.empty() ? "" : "; nearest: " + names.front();
}

}  // namespace shiftrig::io
