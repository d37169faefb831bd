// SPDX-License-Identifier: MIT
#include "proto/recording/frame_check.h"

#include <optional>
#include <string>
#include <utility>

#include "proto/recording/recording_reader.h"

namespace clothstream::recording {

tl::expected<FrameCheck, std::string> FrameCheck::make(const codec::StreamLayout& layout) {
  if (!codec::isCodec(layout.codec))
    return tl::unexpected("its stream has the unknown codec " + std::to_string(layout.codec) +
                          "; this version decodes codec " + std::to_string(codec::kCodecHierarchical));
  auto decoder = codec::Decoder::make(layout);
  if (!decoder) return tl::unexpected(std::string("the description of its stream is not possible"));
  return FrameCheck(std::move(decoder));
}

FrameCheck::Outcome FrameCheck::take(std::string_view bytes, double seconds) {
  const std::optional<FrameContent> frame = frameContentOf(bytes);
  const auto packet = frame ? codec::parsePacket(frame->packet) : std::nullopt;
  const auto tick = packet ? std::optional(packet->header.tick) : std::nullopt;
  const auto faulty = [&](const char* what) {
    reason_ = "the frame of " + FrameFaults::nameOf(tick, seconds) + " " + what;
    return Outcome::faulty;
  };
  const bool isKey = packet && packet->header.kind == codec::PacketKind::key;
  const codec::DecodeResult result =
      packet && faults_.mayFollow(isKey) ? decoder_->decode(frame->packet) : codec::DecodeResult::malformed;
  if (result == codec::DecodeResult::ok) {
    if (decoder_->reconstructionHash() == frame->reconstructionHash) {
      faults_.addGood();
      return Outcome::decoded;
    }
    faults_.addDifferent(*tick, seconds);
    return faulty("differs from its recorded hash");
  }
  if (result == codec::DecodeResult::stale && *tick == decoder_->tick() &&
      frame->reconstructionHash == decoder_->reconstructionHash()) {
    faults_.addGood();
    return Outcome::repeated;
  }
  faults_.addUndecodable(tick, seconds);
  return faulty("cannot be decoded");
}

void FrameCheck::restart() {
  decoder_->restart();
}

void FrameCheck::clear() {
  restart();
  faults_ = {};
}

}  // namespace clothstream::recording
