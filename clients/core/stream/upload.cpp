// SPDX-License-Identifier: MIT
// Windows of pieces, pings between them, and the request at the end.
#include "clients/core/stream/upload.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "clients/core/wire/client_message.h"
#include "clients/core/wire/scene_request.h"

namespace clothstream::client {
namespace {

std::uint32_t pieceCount(std::size_t bytes) {
  return static_cast<std::uint32_t>((bytes + Upload::kPieceBytes - 1) / Upload::kPieceBytes);
}

}  // namespace

void Upload::begin(std::string content, std::string request, std::uint64_t requestId) {
  *this = {};
  content_ = std::move(content);
  request_ = std::move(request);
  requestId_ = requestId;
  windowEnd_ = std::min(kWindow, pieceCount(content_.size()));
}

void Upload::update(std::uint64_t nowUs) {
  if (!isActive() || nextPiece_ < windowEnd_ || pings_ || pingId_ != 0) return;
  if (nowUs - openedUs_ < kWindowUs) return;
  openedUs_ = nowUs;
  windowEnd_ = std::min(windowEnd_ + kWindow, pieceCount(content_.size()));
}

const std::string* Upload::next(std::uint64_t& lastRequestId) {
  if (!isActive()) return nullptr;
  const std::uint32_t count = pieceCount(content_.size());
  if (nextPiece_ < windowEnd_) {
    const std::string_view data =
        std::string_view(content_).substr(std::size_t{nextPiece_} * kPieceBytes, kPieceBytes);
    writeUploadPiece(message_, requestId_,
                     {.contentId = requestId_,
                      .index = nextPiece_,
                      .count = count,
                      .totalBytes = content_.size(),
                      .data = data});
    pings_ = ++nextPiece_ == windowEnd_;
    return &message_;
  }
  if (pings_) {
    pings_ = false;
    pingId_ = ++lastRequestId;
    writePing(message_, pingId_, 0);
    return &message_;
  }
  if (nextPiece_ < count || isRequested_) return nullptr;
  isRequested_ = true;
  return &request_;
}

void Upload::pongReceived(std::uint64_t requestId) {
  if (!isActive() || pingId_ == 0 || requestId != pingId_) return;
  pingId_ = 0;
  sent_ = std::min<std::uint64_t>(content_.size(), std::uint64_t{nextPiece_} * kPieceBytes);
}

}  // namespace clothstream::client
