// SPDX-License-Identifier: MIT
// Reads and writes the numbers of datagrams, which are little-endian.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <span>

namespace clothstream::datagram {

static_assert(std::endian::native == std::endian::little);

// Reads from the front. Past the end it reads zeros and empty spans, and from then on ok() is false.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <std::unsigned_integral T>
  T number() {
    T value = 0;
    const std::span<const std::byte> taken = take(sizeof value);
    if (ok_) std::memcpy(&value, taken.data(), sizeof value);
    return value;
  }
  std::span<const std::byte> take(std::size_t count) {
    ok_ = ok_ && count <= bytes_.size();
    if (!ok_) return {};
    const std::span<const std::byte> taken = bytes_.first(count);
    bytes_ = bytes_.subspan(count);
    return taken;
  }
  std::span<const std::byte> rest() { return take(bytes_.size()); }

  bool ok() const { return ok_; }
  bool atEnd() const { return bytes_.empty(); }

 private:
  std::span<const std::byte> bytes_;
  bool ok_ = true;
};

// The buffer must have room for what is written.
class Writer {
 public:
  explicit Writer(std::span<std::byte> out) : out_(out) {}

  template <std::unsigned_integral T>
  void number(T value) {
    assert(sizeof value <= room());
    std::memcpy(out_.data() + written_, &value, sizeof value);
    written_ += sizeof value;
  }
  void bytes(std::span<const std::byte> bytes) {
    assert(bytes.size() <= room());
    std::copy(bytes.begin(), bytes.end(), out_.begin() + static_cast<std::ptrdiff_t>(written_));
    written_ += bytes.size();
  }
  void zeros(std::size_t count) {
    assert(count <= room());
    std::fill_n(out_.begin() + static_cast<std::ptrdiff_t>(written_), count, std::byte{});
    written_ += count;
  }

  std::size_t written() const { return written_; }
  std::size_t room() const { return out_.size() - written_; }

 private:
  std::span<std::byte> out_;
  std::size_t written_ = 0;
};

}  // namespace clothstream::datagram
