// SPDX-License-Identifier: MIT
// Range coding with asymmetric numeral systems (J. Duda, arXiv:1311.2540). Several interleaved coders let a
// processor work on several symbols at a time.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "proto/codec/hierarchical/residual_model.h"
#include "proto/codec/hierarchical/simd.h"

namespace clothstream::codec::hierarchical {

inline constexpr std::size_t kCoders = 4;
// State of a coder before the first written symbol, which is the last one read.
inline constexpr std::uint32_t kLowestState = 1u << 16;

// A distribution in the form that RansReader searches.
struct alignas(16) SymbolTable {
  SymbolTable() = default;
  explicit SymbolTable(const Distribution& frequencies);

  std::uint32_t start(std::uint32_t symbol) const {
    return static_cast<std::uint32_t>(bounds[kFirstBound - 1 + symbol]);
  }
  std::uint32_t frequency(std::uint32_t symbol) const {
    return static_cast<std::uint32_t>(bounds[kFirstBound + symbol] - bounds[kFirstBound - 1 + symbol]);
  }
  // Symbol that `bits`, a number of kProbabilityBits bits, selects.
  std::uint32_t symbolAt(std::uint32_t bits) const {
    const Int16x8 wanted = Int16x8::all(static_cast<std::int16_t>(bits));
    return countNotAbove(Int16x8::load(&bounds[kFirstBound]), Int16x8::load(&bounds[kFirstBound + 8]),
                         wanted);
  }

  static constexpr std::size_t kFirstBound = 8;
  // End of each symbol's range, from kFirstBound on.
  std::int16_t bounds[kFirstBound + kSymbols];
};

// Tables of kDistributions.
const std::array<SymbolTable, 2 * kScales>& symbolTables();

// Reads the output of RansWriter. Safe on any bytes.
class RansReader {
 public:
  explicit RansReader(std::span<const std::byte> bytes) : bytes_(bytes) {
    states_.fill(kLowestState);
    if (bytes.empty()) return;
    for (std::uint32_t& state : states_) {
      state = word();
      state |= word() << 16;
    }
  }

  // True if reading this many more symbols cannot reach past the end.
  bool hasRoomFor(std::size_t symbols) const { return at_ + 2 * symbols <= bytes_.size(); }

  // Reads 0 past the end. `within` promises that the symbol cannot reach past the end.
  template <bool within>
  std::uint32_t read(std::size_t coder, const SymbolTable& table) {
    std::uint32_t state = states_[coder];
    const std::uint32_t bits = state & ((1u << kProbabilityBits) - 1);
    const std::uint32_t symbol = table.symbolAt(bits);
    state = table.frequency(symbol) * (state >> kProbabilityBits) + bits - table.start(symbol);
    // Rare and hard to predict, therefore without a branch.
    const std::uint32_t low = state < kLowestState ? 1 : 0;
    const std::uint32_t next = within ? wordWithin(at_) : wordAt(at_);
    states_[coder] = state << 16 * low | (next & (0u - low));
    at_ += 2 * low;
    return symbol;
  }

  std::size_t bytesTaken() const { return at_; }
  // True if all bytes were read and none past the end.
  bool atEnd() const {
    bool end = at_ == bytes_.size();
    for (const std::uint32_t state : states_) end = end && state == kLowestState;
    return end;
  }

 private:
  std::uint32_t word() {
    at_ += 2;
    return wordAt(at_ - 2);
  }
  // Returns 0 past the end.
  std::uint32_t wordAt(std::size_t at) const {
    if (at + 2 > bytes_.size()) return 0;
    return wordWithin(at);
  }
  std::uint32_t wordWithin(std::size_t at) const {
    std::uint16_t word;
    std::memcpy(&word, &bytes_[at], sizeof word);
    if constexpr (std::endian::native == std::endian::big)
      word = static_cast<std::uint16_t>(word << 8 | word >> 8);
    return word;
  }

  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::array<std::uint32_t, kCoders> states_;
};

class RansWriter {
 public:
  explicit RansWriter(std::size_t mostSymbols) : entries_(mostSymbols + 8), words_(mostSymbols) {}

  std::size_t count() const { return count_; }
  // Drops all symbols after the first `count`.
  void shrink(std::size_t count) { count_ = count; }
  void add(std::size_t coder, std::size_t table, std::uint32_t symbol) {
    entries_[count_++] = static_cast<std::uint16_t>(coder << kCoderShift | table << kTableShift | symbol);
  }
  // Adds one symbol for each of four coders, from `coder` on.
  void addFour(std::size_t coder, Int32x4 tables, Int32x4 some) {
    const auto c = static_cast<std::int32_t>(coder);
    const Int32x4 entries =
        Int32x4::of(c, c + 1, c + 2, c + 3).shiftedLeft(kCoderShift) | tables.shiftedLeft(kTableShift) | some;
    narrow(entries, entries).storeFour(&entries_[count_]);
    count_ += 4;
  }

  // Maximum bytes that write() writes. Without symbols it writes none.
  std::size_t bound() const { return 4 * kCoders + 2 * words_.size(); }
  struct Written {
    std::size_t bytes, firstBytes;
  };
  // Writes all symbols. `firstBytes` is the number of bytes that a reader takes for the first `firstSymbols`.
  Written write(std::byte* out, std::size_t firstSymbols);

 private:
  static constexpr int kTableShift = 4, kCoderShift = 10;

  std::vector<std::uint16_t> entries_;  // coder, table and symbol
  std::vector<std::uint16_t> words_;
  std::size_t count_ = 0;
};

}  // namespace clothstream::codec::hierarchical
