#include "io/can/dbc_scanner.h"

#include <charconv>
#include <cmath>

#include "io/input_error.h"

namespace shiftrig::io::can::dbc {

namespace {

bool is_space(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == '\f' || c == '\v';
}
bool is_word_start(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' ||
           (static_cast<unsigned char>(c) & 0x80) != 0;
}
bool is_digit(char c) {
    return c >= '0' && c <= '9';
}
bool is_word(char c) {
    return is_word_start(c) || is_digit(c);
}

bool is_utf8(std::string_view text) {
    for (std::size_t i = 0; i < text.size();) {
        const auto lead = static_cast<unsigned char>(text[i]);
        const std::size_t more = lead < 0x80                   ? 0
                                 : lead >= 0xC2 && lead < 0xE0 ? 1
                                 : lead >= 0xE0 && lead < 0xF0 ? 2
                                 : lead >= 0xF0 && lead < 0xF5 ? 3
                                                               : 4;
        if (more == 4 || i + more >= text.size()) return false;
        for (std::size_t k = 1; k <= more; ++k)
            if ((static_cast<unsigned char>(text[i + k]) & 0xC0) != 0x80) return false;
        i += more + 1;
    }
    return true;
}

}  // namespace

std::string to_utf8(std::string_view text) {
    if (is_utf8(text)) return std::string(text);
    std::string result;
    result.reserve(text.size() + text.size() / 8);
    for (const char c : text) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte < 0x80) {
            result += c;
        } else {
            result += static_cast<char>(0xC0 | (byte >> 6));
            result += static_cast<char>(0x80 | (byte & 0x3F));
        }
    }
    return result;
}

Scanner::Scanner(std::string text, std::string file) : text_(std::move(text)), file_(std::move(file)) {
    if (text_.starts_with("\xEF\xBB\xBF")) at_ = line_start_ = 3;
}

void Scanner::skip_space() {
    while (at_ < text_.size()) {
        const char c = text_[at_];
        if (c == '\n') {
            ++line_;
            line_start_ = ++at_;
        } else if (is_space(c)) {
            ++at_;
        } else if (c == '/' && at_ + 1 < text_.size() && text_[at_ + 1] == '/') {
            while (at_ < text_.size() && text_[at_] != '\n') ++at_;
        } else {
            return;
        }
    }
}

bool Scanner::at_end() {
    skip_space();
    return at_ >= text_.size();
}

bool Scanner::at_line_start() {
    skip_space();
    for (std::size_t i = line_start_; i < at_; ++i)
        if (!is_space(text_[i])) return false;
    return true;
}

bool Scanner::alone_on_line() {
    if (!at_line_start()) return false;
    std::size_t i = at_;
    while (i < text_.size() && is_word(text_[i])) ++i;
    while (i < text_.size() && text_[i] != '\n')
        if (!is_space(text_[i++])) return false;
    return true;
}

char Scanner::peek() {
    return at_end() ? '\0' : text_[at_];
}

int Scanner::line() {
    skip_space();
    return line_;
}

int Scanner::column() const {
    return static_cast<int>(at_ - line_start_) + 1;
}

std::string Scanner::shown() const {
    if (at_ >= text_.size()) return "the file ends";
    std::size_t end = at_ + 1;
    if (is_word(text_[at_]))
        while (end < text_.size() && is_word(text_[end]) && end - at_ < 40) ++end;
    const std::string token = text_.substr(at_, end - at_);
    return token == "\"" ? "found a string" : "found \"" + token + "\"";
}

void Scanner::fail(const std::string& what) {
    skip_space();
    throw InputError(file_, line_, column(), what + ", " + shown());
}

void Scanner::fail_at(int line, const std::string& what) const {
    throw InputError(file_, line, 0, what);
}

std::string Scanner::peek_word() {
    skip_space();
    if (at_ >= text_.size() || !is_word_start(text_[at_])) return {};
    std::size_t end = at_;
    while (end < text_.size() && is_word(text_[end])) ++end;
    return text_.substr(at_, end - at_);
}

std::string Scanner::word() {
    std::string result = peek_word();
    if (result.empty()) fail("a name is wanted");
    at_ += result.size();
    return result;
}

double Scanner::number() {
    skip_space();
    const char* begin = text_.data() + at_;
    const char* end = text_.data() + text_.size();
    if (begin != end && *begin == '+') ++begin;
    double value = 0;
    const auto [rest, error] = std::from_chars(begin, end, value);
    if (error == std::errc::invalid_argument || (error == std::errc{} && !std::isfinite(value)))
        fail("a number is wanted");
    if (error == std::errc::result_out_of_range) fail("a number is beyond what a double holds");
    at_ = static_cast<std::size_t>(rest - text_.data());
    return value;
}

std::int64_t Scanner::integer(std::int64_t smallest, std::int64_t largest, std::string_view meaning) {
    skip_space();
    const char* begin = text_.data() + at_;
    std::int64_t value = 0;
    const auto [rest, error] = std::from_chars(begin, text_.data() + text_.size(), value);
    if (error != std::errc{}) fail(std::string(meaning) + ": an integer is wanted");
    if (value < smallest || value > largest)
        fail(std::string(meaning) + " must be " + std::to_string(smallest) + "…" + std::to_string(largest));
    at_ = static_cast<std::size_t>(rest - text_.data());
    return value;
}

std::string Scanner::string() {
    if (peek() != '"') fail("a string in quotes is wanted");
    const int first_line = line_;
    std::string result;
    for (++at_; at_ < text_.size(); ++at_) {
        const char c = text_[at_];
        if (c == '"') {
            ++at_;
            return result;
        }
        if (c == '\n') {
            ++line_;
            line_start_ = at_ + 1;
        }
        if (c == '\\' && at_ + 1 < text_.size() && (text_[at_ + 1] == '"' || text_[at_ + 1] == '\\'))
            result += text_[++at_];
        else if (c != '\r')
            result += c;
    }
    fail_at(first_line, "a string begins here and never ends");
}

void Scanner::expect(char mark) {
    if (!accept(mark)) fail(std::string("\"") + mark + "\" is wanted");
}

bool Scanner::accept(char mark) {
    if (peek() != mark) return false;
    ++at_;
    return true;
}

void Scanner::skip_token() {
    if (peek_string()) {
        string();
    } else if (const std::string next = peek_word(); !next.empty()) {
        at_ += next.size();
    } else if (!at_end()) {
        ++at_;
    }
}

void Scanner::skip_line() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
}

}  // namespace shiftrig::io::can::dbc
