// SPDX-License-Identifier: MIT
#include "clients/core/stream/newest_frame.h"

#include <utility>

#include "proto/codec/vertex_normals.h"

namespace clothstream::client {

bool NewestFrame::begin(const codec::StreamLayout& layout) {
  if (isMirror_) {
    if (!codec::isPossible(layout)) return false;
    layout_ = layout;
    isTaken_ = false;
  } else {
    auto decoder = codec::Decoder::make(layout);
    if (!decoder) return false;
    decoder_ = std::move(decoder);
  }
  begun_ = true;
  return true;
}

cs_decoding NewestFrame::decode(std::span<const std::byte> packet) {
  const std::uint64_t start = nowUs_ ? nowUs_() : 0;
  const codec::DecodeResult result = decoder_->decode(packet);
  if (nowUs_) decodeMs_ = static_cast<double>(nowUs_() - start) / 1000;
  switch (result) {
    case codec::DecodeResult::ok:
      return CS_DECODING_DONE;
    case codec::DecodeResult::stale:
      return CS_DECODING_SKIPPED;
    case codec::DecodeResult::malformed:
    case codec::DecodeResult::wrongEpoch:
    case codec::DecodeResult::missingReference:
      break;
  }
  return CS_DECODING_REFUSED;
}

cs_decoding NewestFrame::take(const cs_decoded* decoded, std::uint64_t tick) {
  const std::size_t vertices = layout_.vertexCount();
  if (!decoded || decoded->version != CS_DECODED_VERSION) return CS_DECODING_SKIPPED;
  if (decoded->decoding != CS_DECODING_DONE)
    return decoded->decoding == CS_DECODING_REFUSED ? CS_DECODING_REFUSED : CS_DECODING_SKIPPED;
  const bool sendsNormals = layout_.normals != codec::NormalMode::none;
  if (decoded->vertex_count != vertices || !decoded->positions || (sendsNormals && !decoded->normals))
    return CS_DECODING_SKIPPED;
  isTaken_ = true;
  decodeMs_ = decoded->decode_ms;
  taken_.tick = tick;
  taken_.hash = decoded->reconstruction_hash;
  taken_.positions.assign(decoded->positions, decoded->positions + 3 * vertices);
  taken_.normals.clear();
  if (sendsNormals) taken_.normals.assign(decoded->normals, decoded->normals + 3 * vertices);
  return CS_DECODING_DONE;
}

bool NewestFrame::present() const {
  return isTaken_ || (decoder_ && decoder_->hasFrame());
}

std::uint64_t NewestFrame::tick() const {
  return isMirror_ ? taken_.tick : decoder_->tick();
}

std::uint64_t NewestFrame::hash() const {
  return isMirror_ ? taken_.hash : decoder_->reconstructionHash();
}

std::span<const float> NewestFrame::positions() const {
  return isMirror_ ? taken_.positions : decoder_->positions();
}

std::span<const float> NewestFrame::normals() const {
  if (!isMirror_) return decoder_->normals();
  if (taken_.normals.empty()) {
    taken_.normals.resize(taken_.positions.size());
    codec::computeVertexNormals(layout_, taken_.positions.data(), taken_.normals.data());
  }
  return taken_.normals;
}

}  // namespace clothstream::client
