// SPDX-License-Identifier: MIT
// A recursive-descent reader of the part of TOML that options need.
#include "server/option_file.h"

#include <algorithm>
#include <charconv>
#include <cstdint>

#include <fmt/format.h>

namespace clothstream {
namespace {

bool isLetterOrDigit(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
}

bool isNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

void appendUtf8(std::string& out, std::uint32_t code) {
  const auto byte = [&](std::uint32_t value) { out += static_cast<char>(value); };
  if (code < 0x80) {
    byte(code);
  } else if (code < 0x800) {
    byte(0xc0 | code >> 6);
    byte(0x80 | (code & 0x3f));
  } else if (code < 0x10000) {
    byte(0xe0 | code >> 12);
    byte(0x80 | (code >> 6 & 0x3f));
    byte(0x80 | (code & 0x3f));
  } else {
    byte(0xf0 | code >> 18);
    byte(0x80 | (code >> 12 & 0x3f));
    byte(0x80 | (code >> 6 & 0x3f));
    byte(0x80 | (code & 0x3f));
  }
}

class Reader {
 public:
  Reader(std::string_view text, const std::string& name) : text_(text), name_(name) {}

  std::vector<FileEntry> read() {
    std::vector<FileEntry> entries;
    for (skipBlankLines(); !atEnd(); skipBlankLines()) {
      FileEntry entry = readEntry();
      const auto first = std::ranges::find(entries, entry.key, &FileEntry::key);
      if (first != entries.end())
        fail(fmt::format("'{}' is given twice, first on line {}; keep one", entry.key, first->line));
      entries.push_back(std::move(entry));
    }
    return entries;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw OptionError(fmt::format("{}:{}: {}", name_, line_, what));
  }

  bool atEnd() const { return at_ == text_.size(); }
  // The next character, or '\n' at the end of the text.
  char peek() const { return atEnd() ? '\n' : text_[at_]; }
  char take() {
    const char c = peek();
    if (!atEnd()) ++at_;
    return c;
  }

  void skipSpaces() {
    while (peek() == ' ' || peek() == '\t' || peek() == '\r') take();
  }
  void skipComment() {
    if (peek() == '#')
      while (peek() != '\n') take();
  }
  void skipBlankLines() {
    for (;;) {
      skipSpaces();
      skipComment();
      if (atEnd() || peek() != '\n') return;
      take();
      ++line_;
    }
  }

  FileEntry readEntry() {
    if (peek() == '[') fail("tables are not supported; write every key at the top level");
    FileEntry entry{.key = readKey(), .values = {}, .line = line_};
    skipSpaces();
    if (take() != '=') fail(fmt::format("'=' and a value must follow '{}'", entry.key));
    skipSpaces();
    if (peek() == '[')
      entry.values = readArray();
    else
      entry.values.push_back(readValue());
    skipSpaces();
    skipComment();
    if (peek() != '\n')
      fail(fmt::format("there is text after the value of '{}'; use one key per line", entry.key));
    return entry;
  }

  std::string readKey() {
    if (peek() == '"' || peek() == '\'') return readValue();
    std::string key;
    while (isLetterOrDigit(peek()) || peek() == '-' || peek() == '_') key += take();
    if (key.empty()) fail("a line starts with the name of an option, such as port = 8080");
    return key;
  }

  std::vector<std::string> readArray() {
    std::vector<std::string> values;
    take();
    for (;;) {
      skipBlankLines();
      if (atEnd()) fail("the array has no ']'");
      if (peek() == ']') break;
      values.push_back(readValue());
      skipBlankLines();
      if (peek() == ',')
        take();
      else if (!atEnd() && peek() != ']')
        fail("values of an array are separated by ','");
    }
    take();
    return values;
  }

  std::string readValue() {
    if (peek() == '"') return readBasicString();
    if (peek() == '\'') return readLiteralString();
    std::string word;
    while (isLetterOrDigit(peek()) || std::string_view("+-._:/").find(peek()) != std::string_view::npos)
      word += take();
    if (word.empty()) fail("a value is missing; use a string, a number, true, false or an array");
    if (word == "true" || word == "false") return word;
    std::string digits = word;
    std::erase(digits, '_');
    if (!isNumber(digits)) fail(fmt::format("{} is not a number, true or false; put text in quotes", word));
    return digits;
  }

  std::string readLiteralString() {
    std::string value;
    take();
    while (peek() != '\'') {
      if (peek() == '\n') fail("the string has no closing quote on its line");
      value += take();
    }
    take();
    return value;
  }

  std::string readBasicString() {
    std::string value;
    take();
    while (peek() != '"') {
      if (peek() == '\n') fail("the string has no closing quote on its line");
      const char c = take();
      if (c == '\\')
        appendEscape(value);
      else
        value += c;
    }
    take();
    return value;
  }

  void appendEscape(std::string& value) {
    constexpr std::string_view kLetters = "btnfr\"\\", kMeanings = "\b\t\n\f\r\"\\";
    const char letter = take();
    if (const auto found = kLetters.find(letter); found != std::string_view::npos)
      value += kMeanings[found];
    else if (letter == 'u' || letter == 'U')
      appendUtf8(value, readCodePoint(letter == 'u' ? 4 : 8));
    else
      fail(fmt::format("\\{} is not an escape of TOML; write \\\\ for a backslash, or use single quotes",
                       letter));
  }

  std::uint32_t readCodePoint(std::size_t digits) {
    const std::string_view text = text_.substr(at_, digits);
    std::uint32_t code = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), code, 16);
    if (text.size() < digits || error != std::errc() || end != text.data() + digits || code > 0x10ffff ||
        (code >= 0xd800 && code < 0xe000))
      fail("\\u needs 4 hexadecimal digits, \\U needs 8, of a Unicode character");
    at_ += digits;
    return code;
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
  int line_ = 1;
};

}  // namespace

std::vector<FileEntry> parseOptionFile(std::string_view text, const std::string& name) {
  return Reader(text, name).read();
}

std::string tomlString(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      quoted += {'\\', c};
    else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      quoted += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    else
      quoted += c;
  }
  return quoted + '"';
}

}  // namespace clothstream
