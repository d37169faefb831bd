// SPDX-License-Identifier: MIT
// Datagram with one piece of a frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "proto/datagram/datagram.h"

namespace clothstream::datagram {

// The part that differs between peers.
struct PiecePrefix {
  // Counts the packets with pieces that this peer was sent, repeated pieces too, from 0.
  std::uint32_t packet = 0;
  // Server's clock at sending, microseconds, modulo 2^32.
  std::uint32_t sentUs = 0;
  // Counts the frames that this peer was sent in pieces, from 0. A repeated piece has its frame's number.
  std::uint32_t frame = 0;
};

struct Piece {
  PiecePrefix prefix;
  // Data pieces have the indices from 0, parity pieces those from `dataPieces` on.
  std::uint8_t index = 0;
  std::uint8_t dataPieces = 0;
  // Bytes of the whole frame, which is a serialised ServerMessage.
  std::uint32_t frameBytes = 0;
  std::span<const std::byte> payload;
};

inline constexpr std::size_t kPieceHeaderBytes = 19;
inline constexpr std::size_t kMaxPayloadBytes = kMaxDatagramBytes - kPieceHeaderBytes;
// Larger frames travel on the stream.
inline constexpr std::size_t kMaxFrameBytes = kMaxDataPieces * kMaxPayloadBytes;

// Bytes of each piece of a frame: data pieces have equal length.
inline std::size_t payloadBytes(std::size_t frameBytes, std::size_t dataPieces) {
  return (frameBytes + dataPieces - 1) / dataPieces;
}

// Writes the datagram to `out`, which has at least kMaxDatagramBytes, and returns its length. The payload may
// be shorter than payloadBytes(); zeros are added. The other fields must be as parsePiece() accepts them.
std::size_t writePiece(const Piece& piece, std::span<std::byte> out);

// The payload is a view of the datagram. nullopt if
//  - the datagram has another kind, or more than kMaxDatagramBytes;
//  - there are not 1 to 128 data pieces, or the index is not below their number + 32;
//  - the payload has not the length that follows from the frame's bytes and the number of data pieces;
//  - a data piece would consist of padding alone.
[[nodiscard]] std::optional<Piece> parsePiece(std::span<const std::byte> datagram);

}  // namespace clothstream::datagram
