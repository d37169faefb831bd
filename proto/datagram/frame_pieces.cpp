// SPDX-License-Identifier: MIT
#include "proto/datagram/frame_pieces.h"

#include <algorithm>
#include <cassert>
#include <utility>

namespace clothstream::datagram {

FramePieces::FramePieces(Message message, unsigned parityPieces)
    : message_(std::move(message)),
      dataPieces_(static_cast<unsigned>((message_->size() + kMaxPayloadBytes - 1) / kMaxPayloadBytes)) {
  assert(fits(message_->size()) && parityPieces <= kMaxParityPieces);
  parity_.resize(parityPieces * payloadBytes());
  for (unsigned row = 0; row < parityPieces; ++row)
    makeParity(*message_, row, std::span(parity_).subspan(row * payloadBytes(), payloadBytes()));
}

std::span<const std::byte> FramePieces::payload(unsigned index) const {
  const std::size_t bytes = payloadBytes();
  if (index >= dataPieces_) return std::span(parity_).subspan((index - dataPieces_) * bytes, bytes);
  const std::size_t begin = index * bytes;
  return std::span(*message_).subspan(begin, std::min(bytes, message_->size() - begin));
}

std::size_t FramePieces::write(const PiecePrefix& prefix, unsigned index, std::span<std::byte> out) const {
  assert(index < pieces());
  return writePiece({.prefix = prefix,
                     .index = static_cast<std::uint8_t>(index),
                     .dataPieces = static_cast<std::uint8_t>(dataPieces_),
                     .frameBytes = static_cast<std::uint32_t>(message_->size()),
                     .payload = payload(index)},
                    out);
}

}  // namespace clothstream::datagram
