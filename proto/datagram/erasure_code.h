// SPDX-License-Identifier: MIT
// Systematic Reed-Solomon code over GF(256): k data pieces and up to 32 parity pieces of equal length, of
// which any k give all data pieces.
#pragma once

#include <cstddef>
#include <span>

namespace clothstream::datagram {

inline constexpr unsigned kMaxDataPieces = 128, kMaxParityPieces = 32;

// Makes the parity piece of a row, 0 to 31, into `parity`, which has the length of a piece. A row does not
// depend on how many others are made. `data` holds 1 to 128 pieces one after the other; a last piece that is
// shorter counts as if zeros followed.
//
// Row j of the matrix is 1 / (x_j + i) for data piece i, with x_j = 255 - j: a Cauchy matrix, all square
// parts of which can be inverted (Blömer et al., "An XOR-Based Erasure-Resilient Coding Scheme", ICSI
// TR-95-048). The field has the polynomial x^8 + x^4 + x^3 + x^2 + 1.
//
// Cost: reads `data` once, about 0.35 ns a byte with SSE2 (2.5 us for 7 pieces of 1,043 bytes).
void makeParity(std::span<const std::byte> data, unsigned row, std::span<std::byte> parity);

struct CodedPiece {
  // Data pieces count from 0, parity pieces continue after them.
  unsigned index = 0;
  std::span<std::byte> bytes;
};

// Writes all data pieces to `data`, one after the other, from as many pieces: `pieces` has k different ones
// of equal length, k is 1 to 128, indices are below k + 32. `data` has room for k pieces. Overwrites the
// bytes of parity pieces.
//
// Cost: copies the data pieces. Each missing one reads k pieces more.
void recoverData(std::span<const CodedPiece> pieces, std::span<std::byte> data);

}  // namespace clothstream::datagram
