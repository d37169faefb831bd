// SPDX-License-Identifier: MIT
#include "server/endpoint/datagram/shared_pieces.h"

#include <algorithm>

namespace clothstream::endpoint {

using datagram::FramePieces;

std::shared_ptr<const FramePieces> SharedPieces::of(const delivery::SharedBytes& message, unsigned rows) {
  constexpr std::size_t kLeastSweep = 64;
  if (pieces_.size() >= sweepBeyond_) {
    std::erase_if(pieces_, [](const auto& entry) { return entry.second.expired(); });
    sweepBeyond_ = std::max(kLeastSweep, 2 * pieces_.size());
  }
  std::weak_ptr<const FramePieces>& known = pieces_[message.get()];
  std::shared_ptr<const FramePieces> pieces = known.lock();
  const unsigned made = pieces ? pieces->pieces() - pieces->dataPieces() : 0;
  if (!pieces || made < rows) {
    const unsigned doubled = std::min(2 * made, datagram::kMaxParityPieces);
    known = pieces = std::make_shared<const FramePieces>(message, std::max(rows, doubled));
  }
  return pieces;
}

}  // namespace clothstream::endpoint
