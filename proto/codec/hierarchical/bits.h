// SPDX-License-Identifier: MIT
// Streams of bits, and short codes for small numbers.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace clothstream::codec::hierarchical {

// Writes bits, lowest first. The caller makes sure that `out` has room.
class BitWriter {
 public:
  explicit BitWriter(std::byte* out) : out_(out) {}

  void put(std::uint32_t value, unsigned bits) {
    pending_ |= std::uint64_t{value} << count_;
    for (count_ += bits; count_ >= 8; count_ -= 8) {
      *out_++ = static_cast<std::byte>(pending_);
      pending_ >>= 8;
    }
  }
  // Writes the Elias gamma code of value + 2^k; small values take few bits. value < 2^31.
  void putGamma(std::uint32_t value, unsigned k) {
    const std::uint32_t shifted = value + (1u << k);
    const auto width = static_cast<unsigned>(std::bit_width(shifted));
    put(0, width - 1 - k);
    put(1, 1);
    put(shifted - std::bit_floor(shifted), width - 1);
  }
  // Number of bytes written since `start`, including a partly filled last byte.
  std::size_t bytesSince(const std::byte* start) const {
    return static_cast<std::size_t>(out_ - start) + (count_ > 0 ? 1 : 0);
  }
  // Fills the last byte with zeros and returns the address of the next byte.
  std::byte* finish() {
    if (count_ > 0) put(0, 8 - count_);
    return out_;
  }

 private:
  std::byte* out_;
  std::uint64_t pending_ = 0;
  unsigned count_ = 0;
};

class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  // Reads zeros past the end.
  std::uint32_t get(unsigned bits) {
    if (count_ < bits) refill();
    const auto value = static_cast<std::uint32_t>(pending_ & ((std::uint64_t{1} << bits) - 1));
    pending_ >>= bits;
    count_ -= bits;
    return value;
  }
  std::uint32_t getGamma(unsigned k) {
    unsigned extra = 0;
    while (get(1) == 0) {
      if (++extra + k > 30) return broken_ = true, 0u;
    }
    const unsigned width = k + extra;
    return (get(width) | 1u << width) - (1u << k);
  }
  // Number of bytes from which at least one bit was read.
  std::size_t bytesTaken() const { return at_ - count_ / 8; }
  // True if all bytes were read, none was missing, and the rest of the last byte is zero.
  bool atEnd() const {
    const std::size_t whole = count_ / 8;  // pending bytes of which no bit was read
    return !broken_ && at_ == bytes_.size() + whole && pending_ == 0;
  }

 private:
  void refill() {
    for (; count_ <= 56; count_ += 8, ++at_) {
      if (at_ < bytes_.size()) pending_ |= std::uint64_t{static_cast<std::uint8_t>(bytes_[at_])} << count_;
    }
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;  // index of the next byte; past the end it counts zero bytes that were read instead
  std::uint64_t pending_ = 0;
  unsigned count_ = 0;
  bool broken_ = false;
};

}  // namespace clothstream::codec::hierarchical
