// Words, numbers, strings and marks of a DBC file, with their places. Used by dbc.cpp only.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace shiftrig::io::can::dbc {

class Scanner {
  public:
    Scanner(std::string text, std::string file);

    bool at_end();
    bool at_line_start();  // is the next token the first of its line?
    bool alone_on_line();  // … and is the next token, a word, the only one of its line?

    // Each reads the next token or throws InputError naming what it wanted and what is there.
    std::string word();
    double number();
    std::int64_t integer(std::int64_t smallest, std::int64_t largest, std::string_view meaning);
    std::string string();
    void expect(char mark);

    std::string peek_word();  // empty if no word is next
    char peek();              // next character, 0 at the end
    bool accept(char mark);
    bool peek_string() { return peek() == '"'; }
    void skip_token();
    void skip_line();

    int line();  // of the next token
    [[noreturn]] void fail(const std::string& what);
    [[noreturn]] void fail_at(int line, const std::string& what) const;

  private:
    void skip_space();
    int column() const;
    std::string shown() const;

    std::string text_, file_;
    std::size_t at_ = 0, line_start_ = 0;
    int line_ = 1;
};

// Latin-1 (with the C1 range of Windows-1252 left as it is) to UTF-8, unless the text is UTF-8 already.
std::string to_utf8(std::string_view text);

}  // namespace shiftrig::io::can::dbc
