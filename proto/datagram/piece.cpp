// SPDX-License-Identifier: MIT
#include "proto/datagram/piece.h"

#include <cassert>

#include "proto/datagram/bytes.h"

namespace clothstream::datagram {
namespace {

bool isValid(const Piece& piece) {
  const std::size_t count = piece.dataPieces;
  if (count == 0 || count > kMaxDataPieces || piece.index >= count + kMaxParityPieces) return false;
  if (piece.frameBytes == 0 || piece.frameBytes > count * kMaxPayloadBytes) return false;
  return (count - 1) * payloadBytes(piece.frameBytes, count) < piece.frameBytes;
}

}  // namespace

std::size_t writePiece(const Piece& piece, std::span<std::byte> out) {
  assert(isValid(piece) && out.size() >= kMaxDatagramBytes);
  const std::size_t bytes = payloadBytes(piece.frameBytes, piece.dataPieces);
  assert(piece.payload.size() <= bytes);
  Writer writer(out);
  writer.number(static_cast<std::uint8_t>(Kind::piece));
  writer.number(piece.prefix.packet);
  writer.number(piece.prefix.sentUs);
  writer.number(piece.prefix.frame);
  writer.number(piece.index);
  writer.number(piece.dataPieces);
  writer.number(piece.frameBytes);
  writer.bytes(piece.payload);
  writer.zeros(bytes - piece.payload.size());
  return writer.written();
}

std::optional<Piece> parsePiece(std::span<const std::byte> datagram) {
  if (kindOf(datagram) != Kind::piece) return std::nullopt;
  Reader reader(datagram.subspan(1));
  Piece piece;
  piece.prefix.packet = reader.number<std::uint32_t>();
  piece.prefix.sentUs = reader.number<std::uint32_t>();
  piece.prefix.frame = reader.number<std::uint32_t>();
  piece.index = reader.number<std::uint8_t>();
  piece.dataPieces = reader.number<std::uint8_t>();
  piece.frameBytes = reader.number<std::uint32_t>();
  piece.payload = reader.rest();
  if (!reader.ok() || !isValid(piece)) return std::nullopt;
  if (piece.payload.size() != payloadBytes(piece.frameBytes, piece.dataPieces)) return std::nullopt;
  return piece;
}

}  // namespace clothstream::datagram
