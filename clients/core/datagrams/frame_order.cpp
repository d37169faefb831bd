// SPDX-License-Identifier: MIT
#include "clients/core/datagrams/frame_order.h"

#include <algorithm>
#include <span>
#include <utility>

#include "clients/core/wire/server_message.h"
#include "proto/codec/packet_header.h"

namespace clothstream::client {

std::optional<FrameHeader> frameHeader(Bytes bytes) {
  const std::optional<ServerMessage> message = readServerMessage(bytes);
  if (!message || message->kind != Body::frame) return std::nullopt;
  Bytes packet;
  const bool isWhole = readFields(message->body, [&](std::uint32_t tag, Reader& reader) {
    return tag == field::Frame::kPacket.tag ? set(packet, reader.get_view()) : skip(reader);
  });
  const auto parsed =
      isWhole ? codec::parsePacket(std::as_bytes(std::span(packet.data(), packet.size()))) : std::nullopt;
  if (!parsed) return std::nullopt;
  FrameHeader header{.epoch = parsed->header.epoch, .tick = parsed->header.tick, .reference = {}};
  if (parsed->header.referenceCount > 0) header.reference = parsed->header.references[0];
  return header;
}

bool FrameOrder::isOld(const FrameHeader& header) const {
  return newest_ && header.epoch == newest_->epoch && header.tick <= newest_->tick;
}

bool FrameOrder::isReady(const FrameHeader& header) const {
  if (!header.reference) return true;
  return newest_ && header.epoch == newest_->epoch && *header.reference <= newest_->tick;
}

bool FrameOrder::passes(Bytes message, bool isSure, std::uint64_t nowUs) {
  const std::optional<FrameHeader> header = frameHeader(message);
  if (!header) return true;
  if (isOld(*header)) return false;
  if (isReady(*header)) {
    newest_ = header;
    return true;
  }
  const auto place = std::find_if(held_.begin(), held_.end(),
                                  [&](const Held& held) { return held.header.tick >= header->tick; });
  if (place != held_.end() && place->header.tick == header->tick) return false;
  held_.insert(place, {*header, std::string(message.data(), message.size()), nowUs + kHoldUs});
  heldBytes_ += message.size();
  ++heldFrames_;
  if (!isSure || held_.size() > kMaxFrames || heldBytes_ > kMaxBytes)
    for (Held& held : held_) held.untilUs = nowUs;
  return false;
}

std::string FrameOrder::next(std::uint64_t nowUs) {
  while (!held_.empty()) {
    Held& first = held_.front();
    const bool isDropped = isOld(first.header);
    if (!isDropped && !isReady(first.header) && nowUs < first.untilUs) return {};
    if (!isDropped) newest_ = first.header;
    std::string message = std::move(first.message);
    heldBytes_ -= message.size();
    held_.erase(held_.begin());
    if (!isDropped) return message;
  }
  return {};
}

std::optional<std::uint64_t> FrameOrder::dueUs() const {
  return held_.empty() ? std::nullopt : std::optional(held_.front().untilUs);
}

}  // namespace clothstream::client
