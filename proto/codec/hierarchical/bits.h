// SPDX-License-Identifier: MIT
// Plain bits, and small numbers in few of them.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace clothstream::codec::hierarchical {

// Of an Elias gamma of value + 2^k (BitWriter::putGamma()).
constexpr unsigned gammaBits(std::uint32_t value, unsigned k) {
  return 2 * static_cast<unsigned>(std::bit_width(value + (1u << k))) - 1 - k;
}

// Lowest bit first. The caller sees to it that `out` has room.
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
  // Elias gamma of value + 2^k: the smaller the fewer. value < 2^31.
  void putGamma(std::uint32_t value, unsigned k) {
    const std::uint32_t shifted = value + (1u << k);
    const auto width = static_cast<unsigned>(std::bit_width(shifted));
    put(0, width - 1 - k);
    put(1, 1);
    put(shifted - std::bit_floor(shifted), width - 1);
  }
  // How many bytes it takes up to here, the last of which may be shared with what follows.
  std::size_t bytesSince(const std::byte* start) const {
    return static_cast<std::size_t>(out_ - start) + (count_ > 0 ? 1 : 0);
  }
  // Zeros up to a whole byte; where the next byte would stand.
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

  // 0 past the end.
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
  // How many ones stand before the next zero, which is taken with them; of more than `most` (16 at most) so
  // many, and no zero.
  std::uint32_t getOnes(unsigned most) {
    if (count_ <= most) refill();
    const unsigned ones = std::min(static_cast<unsigned>(std::countr_one(pending_)), most);
    const unsigned taken = ones < most ? ones + 1 : ones;
    pending_ >>= taken;
    count_ -= taken;
    return ones;
  }
  // Goes on to a whole byte; false where something is left of the last one.
  [[nodiscard]] bool endByte() { return get(count_ % 8) == 0 && !broken_; }
  // The bytes that were taken from, if only in part.
  std::size_t bytesTaken() const { return at_ - count_ / 8; }
  // All bytes were used, none was missing, and what is left of the last are zeros.
  bool atEnd() const {
    const std::size_t whole = count_ / 8;  // bytes that are pending and untouched
    return !broken_ && at_ == bytes_.size() + whole && pending_ == 0;
  }

 private:
  void refill() {
    for (; count_ <= 56; count_ += 8, ++at_) {
      if (at_ < bytes_.size()) pending_ |= std::uint64_t{static_cast<std::uint8_t>(bytes_[at_])} << count_;
    }
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;  // of the next byte; beyond the end where zeros were taken instead
  std::uint64_t pending_ = 0;
  unsigned count_ = 0;
  bool broken_ = false;
};

}  // namespace clothstream::codec::hierarchical
