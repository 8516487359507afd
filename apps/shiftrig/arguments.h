// Numbers on the command line, and arguments of the form NODE=VALUE. What is wrong is thrown as
// CLI::ValidationError: one line with the option, the value and the rule.
#pragma once

#include <CLI/CLI.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "io/model_file.h"
#include "io/number.h"
#include "io/rule.h"

namespace shiftrig::cli {

inline constexpr double longest_s = 1e9;  // of a run: its nanoseconds fit an std::int64_t

// CLI11's own checks let nan and inf pass.
inline CLI::Validator obeys(const io::Rule& rule, bool whole) {
    const std::string bounds = rule.words().substr(std::string_view("must be ").size());
    const auto wrong = [=](const std::string& text) -> std::string {
        const auto value = io::finite_number(text);
        const bool integral = text.find_first_not_of("+-0123456789") == std::string::npos;
        if (value && rule.holds(*value) && (integral || !whole)) return "";
        return text + "; must be " + (whole ? "a whole number " : "") + bounds;
    };
    return {wrong, bounds};
}

// An option with a number, or with several. Every number comes in this way.
template <class Number>
CLI::Option* add_number(CLI::App& app, const std::string& name, Number& number, const io::Rule& rule,
                        const std::string& help) {
    constexpr bool real = std::is_convertible_v<double, Number> && !std::is_integral_v<Number>;
    return app.add_option(name, number, help)->check(obeys(rule, !real));
}

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
    const auto value = io::finite_number(word);
    if (!value) throw CLI::ValidationError(option, "\"" + text + "\": \"" + word + "\" is no finite number");
    return {name, *value};
}

// --option GEAR=OPTION
inline void select_option(io::ModelFile& file, const std::string& gear, const std::string& option) {
    try {
        io::select_option(file.description, gear, option);
    } catch (const std::invalid_argument& error) {
        throw CLI::ValidationError("--option " + gear + "=" + option, file.path + ": " + error.what());
    }
}

}  // namespace shiftrig::cli
