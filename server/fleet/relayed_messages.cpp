// SPDX-License-Identifier: MIT
#include "server/fleet/relayed_messages.h"

#include <algorithm>
#include <span>
#include <utility>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"
#include "proto/datagram/frame_pieces.h"
#include "server/fleet/message_bytes.h"

namespace clothstream::fleet {

using delivery::SharedBytes;

namespace {

// Header of the packet in a message; nothing if the message is not a frame.
std::optional<codec::PacketHeader> frameHeaderOf(std::span<const std::byte> bytes) {
  v1::ServerMessage message;
  if (!parse(bytes, message) || !message.has_frame()) return std::nullopt;
  const auto packet = codec::parsePacket(std::as_bytes(std::span(message.frame().packet())));
  return packet ? std::optional(packet->header) : std::nullopt;
}

}  // namespace

void RelayedMessages::add(SharedBytes message, std::uint64_t sequence) {
  Waiting waiting{.message = std::move(message), .after = std::exchange(newest_, sequence)};
  // Frames need not be told apart while all messages leave by the stream.
  const auto header =
      usesLink() || needsKeyFrame_ || !frames_.empty() ? frameHeaderOf(*waiting.message) : std::nullopt;
  if (!header) {
    messages_.push_back(std::move(waiting));
    return;
  }
  if (needsKeyFrame_ && header->kind != codec::PacketKind::key) return;
  needsKeyFrame_ = false;
  waiting.tick = header->tick;
  frames_.push_back(std::move(waiting));
}

void RelayedMessages::add(SharedBytes message) {
  messages_.push_back({.message = std::move(message), .after = newest_});
}

void RelayedMessages::acknowledge(std::uint64_t tick) {
  acknowledged_ = std::max(acknowledged_.value_or(0), tick);
}

void RelayedMessages::setLink(std::optional<Link> link) {
  if (usesLink() && !link && newestByLink_ > *acknowledged_) {
    needsKeyFrame_ = true;
    frames_.clear();
  }
  link_ = link;
}

bool RelayedMessages::leavesByLink(const Waiting& frame) const {
  return usesLink() && datagram::FramePieces::fits(frame.message->size());
}

SharedBytes RelayedMessages::next() {
  const bool hasFrame = !frames_.empty() && !leavesByLink(frames_.front());
  const bool frameFirst = hasFrame && (messages_.empty() || frames_.front().after < messages_.front().after);
  std::deque<Waiting>& from = frameFirst ? frames_ : messages_;
  if (from.empty()) return nullptr;
  SharedBytes message = std::move(from.front().message);
  from.pop_front();
  return message;
}

SharedBytes RelayedMessages::nextFrame() {
  if (!hasNextFrame()) return nullptr;
  newestByLink_ = frames_.front().tick;
  SharedBytes frame = std::move(frames_.front().message);
  frames_.pop_front();
  return frame;
}

void RelayedMessages::clear() {
  messages_.clear();
  frames_.clear();
}

std::uint64_t RelayedMessages::taken() const {
  std::uint64_t taken = newest_;
  for (const auto* waiting : {&messages_, &frames_})
    if (!waiting->empty()) taken = std::min(taken, waiting->front().after);
  return taken;
}

void RelayedMessages::forgetChannel() {
  for (auto* waiting : {&messages_, &frames_})
    for (Waiting& each : *waiting) each.after = 0;
  newest_ = 0;
}

}  // namespace clothstream::fleet
