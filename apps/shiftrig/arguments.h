// Arguments of the form NODE=VALUE, shared by several commands. What is wrong is thrown as
// CLI::ValidationError, so that it is reported like any other wrong usage.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>

namespace shiftrig::cli {

// "range=L" → {range, L}; option is the name of the option it was given to.
inline std::pair<std::string, std::string> named_word(const std::string& option, const std::string& text) {
    const auto equals = text.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == text.size())
        throw CLI::ValidationError(option, "\"" + text + "\" must read NAME=VALUE");
    return {text.substr(0, equals), text.substr(equals + 1)};
}

// "input=1.5" → {input, 1.5}.
inline std::pair<std::string, double> named_number(const std::string& option, const std::string& text) {
    const auto [name, word] = named_word(option, text);
    double value = 0;
    if (!CLI::detail::lexical_cast(word, value))
        throw CLI::ValidationError(option, "\"" + text + "\": \"" + word + "\" is no number");
    return {name, value};
}

}  // namespace shiftrig::cli
