// SPDX-License-Identifier: MIT
// Numbers and texts of MCAP: little-endian; a text follows its length.
#pragma once

#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace clothstream::recording {

static_assert(std::endian::native == std::endian::little);

template <std::unsigned_integral T>
void appendNumber(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

inline void appendText(std::string& out, std::string_view text) {
  appendNumber(out, static_cast<std::uint32_t>(text.size()));
  out.append(text);
}

// Reads from the front. Past the end it reads zeros and empty texts, and from then on ok() is false. Texts
// are views of the bytes.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  template <std::unsigned_integral T>
  T number() {
    T value = 0;
    const std::string_view bytes = take(sizeof value);
    if (ok_) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  std::string_view text() { return take(number<std::uint32_t>()); }
  std::string_view take(std::uint64_t count) {
    ok_ = ok_ && count <= bytes_.size();
    if (!ok_) return {};
    const std::string_view taken = bytes_.substr(0, static_cast<std::size_t>(count));
    bytes_.remove_prefix(taken.size());
    return taken;
  }

  bool ok() const { return ok_; }
  // Number of bytes left; 0 if ok() is false.
  std::size_t left() const { return ok_ ? bytes_.size() : 0; }
  std::string_view rest() { return take(left()); }

 private:
  std::string_view bytes_;
  bool ok_ = true;
};

}  // namespace clothstream::recording
