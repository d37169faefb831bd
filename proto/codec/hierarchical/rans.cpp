// SPDX-License-Identifier: MIT
// Range coding with asymmetric numeral systems.
#include "proto/codec/hierarchical/rans.h"

namespace clothstream::codec::hierarchical {

SymbolTable::SymbolTable(const Distribution& frequencies) : bounds{} {
  for (std::size_t i = 0; i < kSymbols; ++i) {
    bounds[kFirstBound + i] = static_cast<std::int16_t>(bounds[kFirstBound - 1 + i] + frequencies[i]);
  }
}

const std::array<SymbolTable, 2 * kScales>& symbolTables() {
  static const std::array<SymbolTable, 2 * kScales> tables = [] {
    std::array<SymbolTable, 2 * kScales> made;
    for (std::size_t i = 0; i < made.size(); ++i) made[i] = SymbolTable(kDistributions[i]);
    return made;
  }();
  return tables;
}

RansWriter::Written RansWriter::write(std::byte* out, std::size_t firstSymbols) {
  if (count_ == 0) return {0, 0};
  const std::array<SymbolTable, 2 * kScales>& tables = symbolTables();
  std::array<std::uint32_t, kCoders> states;
  states.fill(kLowestState);
  std::uint16_t* const end = words_.data() + words_.size();
  std::uint16_t *first = end, *firstEnd = end;
  // Starts with the last symbol, so that a reader gets them in the order of add().
  for (std::size_t i = count_; i-- > 0;) {
    if (i + 1 == firstSymbols) firstEnd = first;
    const std::uint32_t entry = entries_[i], symbol = entry & (kSymbols - 1);
    std::uint32_t& state = states[entry >> kCoderShift];
    const SymbolTable& table = tables[entry >> kTableShift & ((1u << (kCoderShift - kTableShift)) - 1)];
    const std::uint32_t start = table.start(symbol), frequency = table.frequency(symbol);
    // True if the state would otherwise reach 2^32 after this symbol.
    if (state >> (32 - kProbabilityBits) >= frequency) {
      *--first = static_cast<std::uint16_t>(state);
      state >>= 16;
    }
    state = ((state / frequency) << kProbabilityBits) + state % frequency + start;
  }
  std::byte* to = out;
  const auto put = [&to](std::uint32_t word) {
    *to++ = static_cast<std::byte>(word);
    *to++ = static_cast<std::byte>(word >> 8);
  };
  for (const std::uint32_t state : states) {
    put(state);
    put(state >> 16);
  }
  if (firstSymbols == 0) firstEnd = first;
  const auto wordsOfFirst = static_cast<std::size_t>(firstEnd - first);
  for (; first != end; ++first) put(*first);
  return {static_cast<std::size_t>(to - out), 4 * kCoders + 2 * wordsOfFirst};
}

}  // namespace clothstream::codec::hierarchical
