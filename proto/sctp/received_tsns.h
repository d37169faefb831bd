// SPDX-License-Identifier: MIT
// TSNs that have arrived, for duplicates and acknowledgements (RFC 9260, sections 6.2 and 6.2.1).
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/sctp/chunks.h"

namespace clothstream::sctp {

// Knows the TSNs up to 1,024 after the cumulative one. A peer that repeats nothing closes its gaps with
// FORWARD-TSN, so gaps stay short.
class ReceivedTsns {
 public:
  static constexpr std::uint32_t kWindow = 1024;
  static constexpr std::size_t kMaxGapBlocks = 64;
  using GapBlocks = std::array<GapBlock, kMaxGapBlocks>;

  explicit ReceivedTsns(std::uint32_t firstTsn) : cumulative_(firstTsn - 1), highest_(cumulative_) {}

  // A chunk that is too far ahead is not taken, and must not be delivered.
  enum class Arrival { isNew, duplicate, tooFar };
  Arrival add(std::uint32_t tsn);
  // The peer gives up all TSNs up to this one (RFC 3758, section 3.6). Returns false if that changes nothing.
  bool skipTo(std::uint32_t tsn);

  std::uint32_t cumulative() const { return cumulative_; }
  bool hasGaps() const { return highest_ != cumulative_; }
  // Writes blocks of TSNs that have arrived after a gap, lowest first and as many as fit, into `blocks`.
  // Returns them.
  std::span<const GapBlock> gapBlocks(GapBlocks& blocks) const;

 private:
  void advance();

  std::uint32_t cumulative_, highest_;  // highest that has arrived, at least the cumulative one
  std::bitset<kWindow> after_;          // TSN modulo kWindow; those after the cumulative one
};

}  // namespace clothstream::sctp
