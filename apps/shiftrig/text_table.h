// Columns for a terminal: the first one flush left, the others flush right.
#pragma once

#include <cstdio>
#include <cstring>
#include <ostream>
#include <string>
#include <vector>

namespace shiftrig::cli {

// A number with so many significant digits.
inline std::string digits(double value, int count = 5) {
    char text[40];
    std::snprintf(text, sizeof text, "%.*g", count, value);
    return text;
}

// A number with so many decimals; one too long for that by its digits.
inline std::string decimals(double value, int count) {
    char text[40];
    if (std::snprintf(text, sizeof text, "%.*f", count, value) >= static_cast<int>(sizeof text))
        return digits(value, 9);
    const bool minus_zero = text[0] == '-' && std::strspn(text + 1, "0.") == std::strlen(text + 1);
    return minus_zero ? text + 1 : text;
}

class TextTable {
  public:
    void row(std::vector<std::string> cells) { rows_.push_back(std::move(cells)); }

    void print(std::ostream& out, const std::string& indent = "  ") const {
        std::vector<std::size_t> width;
        for (const auto& cells : rows_)
            for (std::size_t i = 0; i < cells.size(); ++i) {
                if (width.size() <= i) width.push_back(0);
                width[i] = std::max(width[i], shown(cells[i]));
            }
        for (const auto& cells : rows_) {
            std::string line = indent;
            for (std::size_t i = 0; i < cells.size(); ++i) {
                const std::string pad(width[i] - shown(cells[i]), ' ');
                line += i == 0 ? cells[i] + pad : "  " + pad + cells[i];
            }
            line.erase(line.find_last_not_of(' ') + 1);
            out << line << '\n';
        }
    }

  private:
    // Characters, not bytes, of UTF-8.
    static std::size_t shown(const std::string& text) {
        std::size_t count = 0;
        for (const char c : text) count += (static_cast<unsigned char>(c) & 0xC0) != 0x80;
        return count;
    }
    std::vector<std::vector<std::string>> rows_;
};

}  // namespace shiftrig::cli
