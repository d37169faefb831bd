// SPDX-License-Identifier: MIT
// A short text in a fixed buffer, so that texts that change often allocate nothing.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace clothstream::xr {

// UTF-8 of at most kMost bytes. What is longer is cut after a whole character.
class FixedText {
 public:
  static constexpr std::size_t kMost = 254;

  FixedText() = default;
  FixedText(std::string_view text) { fill(text.data(), text.size()); }
  FixedText(const char* text) : FixedText(std::string_view(text)) {}
  FixedText(const std::string& text) : FixedText(std::string_view(text)) {}

  template <typename... Arguments>
  static FixedText format(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
    FixedText text;
    const auto written =
        fmt::format_to_n(text.bytes_.data(), kMost, format, std::forward<Arguments>(arguments)...);
    text.setSize(written.size);
    return text;
  }

  std::string_view view() const { return {bytes_.data(), size_}; }
  operator std::string_view() const { return view(); }
  bool empty() const { return size_ == 0; }
  // Replaces each byte `from` by `to`.
  void replace(char from, char to) { std::replace(bytes_.begin(), bytes_.begin() + size_, from, to); }

  friend bool operator==(const FixedText& a, const FixedText& b) { return a.view() == b.view(); }

 private:
  void fill(const char* text, std::size_t size) {
    std::copy_n(text, std::min(size, kMost), bytes_.begin());
    setSize(size);
  }
  // The text has `size` bytes, of which the buffer has the first kMost at most.
  void setSize(std::size_t size) {
    std::size_t kept = std::min(size, kMost);
    if (size > kMost) {
      while (kept > 0 && (static_cast<unsigned char>(bytes_[kept - 1]) & 0xC0U) == 0x80) --kept;
      if (kept > 0 && static_cast<unsigned char>(bytes_[kept - 1]) >= 0x80) --kept;
    }
    size_ = static_cast<std::uint8_t>(kept);
  }

  std::array<char, kMost> bytes_{};
  std::uint8_t size_ = 0;
};

}  // namespace clothstream::xr
