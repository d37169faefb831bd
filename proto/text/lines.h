// SPDX-License-Identifier: MIT
// Lines of text files, whatever program wrote them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace clothstream {

// Returns the text without the byte-order mark of UTF-8 that it may start with.
constexpr std::string_view withoutByteOrderMark(std::string_view text) {
  return text.starts_with("\xef\xbb\xbf") ? text.substr(3) : text;
}

// Returns whether the bytes look like UTF-16 or UTF-32: they start with its byte-order mark, or a zero is
// among the first four.
constexpr bool isWideText(std::string_view bytes) {
  return bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff") ||
         bytes.substr(0, 4).find('\0') != std::string_view::npos;
}

// Lines of a text that end with LF, CR LF or CR. A backslash at the end of a line continues it on the next
// one: both are one line, with a space in place of the backslash. Comments, whose first character is '#', do
// not continue.
class ContinuedLines {
 public:
  explicit ContinuedLines(std::string_view text) : rest_(text) {}

  // Goes to the next line. False if there is none.
  bool next() {
    if (rest_.empty()) return false;
    number_ = taken_ + 1;
    line_ = take();
    if (!line_.ends_with('\\') || isComment(line_)) return true;
    joined_.clear();
    for (bool continues = true; continues;) {
      continues = line_.ends_with('\\') && !rest_.empty();
      joined_ += line_.ends_with('\\') ? line_.substr(0, line_.size() - 1) : line_;
      if (!continues) break;
      joined_ += ' ';
      line_ = take();
    }
    line_ = joined_;
    return true;
  }

  // Text of the line without its end. Valid until the next call of next().
  std::string_view text() const { return line_; }
  // Number of the line, or of the first one of several that are continued, counted from 1.
  std::size_t number() const { return number_; }

 private:
  static bool isComment(std::string_view line) {
    const std::size_t first = line.find_first_not_of(" \t");
    return first != line.npos && line[first] == '#';
  }

  std::string_view take() {
    std::size_t end = 0;
    while (end < rest_.size() && rest_[end] != '\n' && rest_[end] != '\r') ++end;
    const std::string_view line = rest_.substr(0, end);
    const bool hasTwo = rest_.substr(end).starts_with("\r\n");
    rest_.remove_prefix(end == rest_.size() ? end : end + (hasTwo ? 2 : 1));
    ++taken_;
    return line;
  }

  std::string_view rest_, line_;
  std::string joined_;
  std::size_t taken_ = 0, number_ = 0;  // lines that end at `rest_`; number of the line
};

}  // namespace clothstream
