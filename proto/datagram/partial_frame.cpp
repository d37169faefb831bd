// SPDX-License-Identifier: MIT
#include "proto/datagram/partial_frame.h"

namespace clothstream::datagram {

PartialFrame::Added PartialFrame::add(const Piece& piece) {
  if (dataPieces_ == 0) {
    dataPieces_ = piece.dataPieces;
    frameBytes_ = piece.frameBytes;
  }
  if (isComplete() || present_[piece.index]) return Added::useless;
  if (piece.dataPieces != dataPieces_ || piece.frameBytes != frameBytes_) return Added::useless;
  indices_[present_.count()] = piece.index;
  present_[piece.index] = true;
  stored_.insert(stored_.end(), piece.payload.begin(), piece.payload.end());
  if (present_.count() < dataPieces_) return Added::stored;
  putTogether();
  return Added::completed;
}

void PartialFrame::putTogether() {
  const std::size_t count = dataPieces_, bytes = payloadBytes(frameBytes_, count);
  std::array<CodedPiece, kMaxDataPieces> pieces;
  for (std::size_t i = 0; i < count; ++i) {
    pieces[i] = {.index = indices_[i], .bytes = std::span(stored_).subspan(i * bytes, bytes)};
    usedParity_ = usedParity_ || indices_[i] >= count;
  }
  message_.resize(count * bytes);
  recoverData(std::span(pieces).first(count), message_);
  message_.resize(frameBytes_);
  stored_ = {};
}

}  // namespace clothstream::datagram
