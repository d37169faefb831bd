// SPDX-License-Identifier: MIT
// Writes and parses the dictionary of an array's header.
#include "clients/files/npy_header.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace clothstream::files {
namespace {

constexpr std::size_t kAlignment = 64;
constexpr std::size_t kMaxDimensions = 8;

// Reads a literal of Python: a dictionary with text, True, False and tuples of whole numbers.
class LiteralReader {
 public:
  explicit LiteralReader(std::string_view text) : text_(text) {}

  bool skip(std::string_view token) {
    space();
    if (!text_.starts_with(token)) return false;
    text_.remove_prefix(token.size());
    return true;
  }
  std::optional<std::string> text() {
    space();
    if (text_.empty() || (text_[0] != '\'' && text_[0] != '"')) return std::nullopt;
    const std::size_t end = text_.find(text_[0], 1);
    if (end == text_.npos) return std::nullopt;
    std::string value(text_.substr(1, end - 1));
    text_.remove_prefix(end + 1);
    return value;
  }
  std::optional<std::vector<std::uint64_t>> tuple() {
    if (!skip("(")) return std::nullopt;
    std::vector<std::uint64_t> numbers;
    while (!skip(")")) {
      std::uint64_t number = 0;
      space();
      const auto [end, error] = std::from_chars(text_.data(), text_.data() + text_.size(), number);
      if (error != std::errc() || numbers.size() == kMaxDimensions) return std::nullopt;
      text_.remove_prefix(static_cast<std::size_t>(end - text_.data()));
      numbers.push_back(number);
      if (!skip(",") && !text_.starts_with(")")) return std::nullopt;
    }
    return numbers;
  }
  bool atEnd() {
    space();
    return text_.empty();
  }

 private:
  void space() { text_.remove_prefix(std::min(text_.find_first_not_of(" \t\r\n"), text_.size())); }

  std::string_view text_;
};

tl::unexpected<std::string> notAnArray() {
  return tl::unexpected(std::string("its header is not that of an array which numpy.save writes"));
}

// Whether the type is one of those that elementBytes() knows.
bool isKnown(std::string_view type) {
  if (type.size() < 3 || (type[0] != '<' && type[0] != '|')) return false;
  std::size_t bytes = 0;
  const auto [end, error] = std::from_chars(type.data() + 2, type.data() + type.size(), bytes);
  if (error != std::errc() || end != type.data() + type.size()) return false;
  if (type[1] == 'U') return bytes >= 1 && bytes <= 1024;
  if (type[0] == '|' && bytes != 1) return false;
  if (type[1] == 'f') return bytes == 4 || bytes == 8;
  return (type[1] == 'i' || type[1] == 'u') && (bytes == 1 || bytes == 2 || bytes == 4 || bytes == 8);
}

}  // namespace

std::size_t NpyHeader::elementBytes() const {
  std::size_t number = 0;
  std::from_chars(type.data() + 2, type.data() + type.size(), number);
  return type[1] == 'U' ? 4 * number : number;
}

std::uint64_t NpyHeader::rowElements() const {
  std::uint64_t count = 1;
  for (std::size_t i = 1; i < shape.size(); ++i) count *= shape[i];
  return count;
}

std::uint64_t NpyHeader::elements() const {
  return shape.empty() ? 1 : shape[0] * rowElements();
}

std::string npyHeader(const NpyHeader& header, std::size_t bytes) {
  // A tuple of one element has a comma.
  std::string dictionary =
      fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}{}), }}", header.type,
                  fmt::join(header.shape, ", "), header.shape.size() == 1 ? "," : "");
  const std::size_t least = kNpyPreambleBytes + dictionary.size() + 1;
  const std::size_t whole = bytes > 0 ? bytes : (least + kAlignment - 1) / kAlignment * kAlignment;
  dictionary.append(whole - least, ' ').push_back('\n');
  std::string text(kNpyMagic);
  text.append("\x01\x00", 2);  // version
  text.push_back(static_cast<char>(dictionary.size() & 0xff));
  text.push_back(static_cast<char>(dictionary.size() >> 8));
  return text + dictionary;
}

tl::expected<NpyHeader, std::string> parseNpyHeader(std::string_view dictionary) {
  LiteralReader reader(dictionary);
  NpyHeader header;
  std::optional<bool> fortran;
  std::optional<std::vector<std::uint64_t>> shape;
  if (!reader.skip("{")) return notAnArray();
  while (!reader.skip("}")) {
    const auto key = reader.text();
    if (!key || !reader.skip(":")) return notAnArray();
    if (*key == "descr") {
      const auto type = reader.text();
      if (!type)
        return tl::unexpected(std::string("it has named columns; save its columns as separate arrays"));
      header.type = *type;
    } else if (*key == "fortran_order") {
      fortran = reader.skip("True");
      if (!*fortran && !reader.skip("False")) return notAnArray();
    } else if (*key == "shape") {
      shape = reader.tuple();
      if (!shape) return notAnArray();
    } else {
      return notAnArray();
    }
    reader.skip(",");
  }
  if (!reader.atEnd() || header.type.empty() || !fortran || !shape) return notAnArray();
  if (!isKnown(header.type))
    return tl::unexpected(fmt::format(
        "its type is \"{}\"; little-endian numbers of 1 to 8 bytes are allowed, for example \"<f4\"",
        header.type.substr(0, 20)));
  if (*fortran && shape->size() > 1)
    return tl::unexpected(
        std::string("it is in Fortran order; save it after numpy.ascontiguousarray(), which reorders it"));
  header.shape = std::move(*shape);
  std::uint64_t room = std::numeric_limits<std::int64_t>::max() / header.elementBytes();
  for (const std::uint64_t count : header.shape) {
    if (count > room) return tl::unexpected(std::string("its shape is too large"));
    if (count > 0) room /= count;
  }
  return header;
}

}  // namespace clothstream::files
