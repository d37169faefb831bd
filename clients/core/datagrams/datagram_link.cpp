// SPDX-License-Identifier: MIT
#include "clients/core/datagrams/datagram_link.h"

#include <algorithm>
#include <utility>

#include "proto/datagram/piece.h"
#include "proto/datagram/piece_request.h"

namespace clothstream::client {

static_assert(CS_MAX_DATAGRAM_BYTES == datagram::kMaxDatagramBytes);

namespace {

// Poses that move attachments or joints are sent once, so they must not be lost.
bool repeatsEverything(Bytes poses) {
  using F = field::ColliderPoses;
  return readFields(poses, [](std::uint32_t tag, Reader& reader) {
    return tag != F::kAttachments.tag && tag != F::kJoints.tag && skip(reader);
  });
}

// Properties of an outgoing ClientMessage.
struct Outgoing {
  bool isPoses = false;
  bool mayBeLost = false;  // later messages replace it
  bool isAcknowledgement = false;
};

Outgoing classify(Bytes message) {
  using F = field::ClientMessage;
  Outgoing found;
  const bool isWhole = readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag == F::kColliderPoses.tag) {
      found = {.isPoses = true, .mayBeLost = repeatsEverything(reader.get_view())};
      return true;
    }
    found.isAcknowledgement |= tag == F::kFrameAck.tag;
    found.mayBeLost |= tag == F::kFrameAck.tag || tag == F::kKeyFrameRequest.tag;
    return skip(reader);
  });
  return isWhole ? found : Outgoing();
}

std::span<const std::byte> asBytes(Bytes message) {
  return std::as_bytes(std::span(message.data(), message.size()));
}

Bytes asMessage(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

void DatagramLink::count(const datagram::Piece& piece) {
  const std::uint32_t packet = piece.prefix.packet;
  if (packets_++ == 0) newestPacket_ = packet;
  const std::int32_t ahead = datagram::steps(static_cast<std::uint32_t>(newestPacket_), packet);
  if (ahead > 0) newestPacket_ += static_cast<std::uint32_t>(ahead);
  if (piece.index >= piece.dataPieces) ++parityPackets_;
}

void DatagramLink::receive(std::span<const std::byte> datagram, std::uint64_t nowUs) {
  const std::optional<datagram::Piece> piece = datagram::parsePiece(datagram);
  if (!piece) return;
  heardUs_ = nowUs;
  count(*piece);
  received_.add(piece->prefix.packet, nowUs);
  const std::uint64_t before = assembly_.statistics().frames;
  assembly_.add(*piece, nowUs);
  completed_ |= assembly_.statistics().frames > before;
}

bool DatagramLink::holds(Bytes message, std::uint64_t nowUs) {
  const std::optional<std::uint64_t> before = order_.newestTick();
  // Before the first frame of the stream, the client may have had others.
  const bool passes = order_.passes(message, before.has_value(), nowUs);
  if (order_.newestTick() != before) lostBeforeStream_ = assembly_.statistics().lostFrames;
  return !passes;
}

bool DatagramLink::sends(Bytes message, std::uint64_t nowUs) {
  const Outgoing outgoing = classify(message);
  std::optional<Unsettled>* const unsettled = outgoing.isPoses             ? &poses_
                                              : outgoing.isAcknowledgement ? &acknowledgement_
                                                                           : nullptr;
  if (unsettled != nullptr) unsettled->reset();
  if (!outgoing.mayBeLost || !inUse(nowUs) || message.size() > datagram::kMaxInputBytes) return false;
  if (unsettled != nullptr) *unsettled = {std::string(message.data(), message.size()), nowUs};
  if (waiting_.size() == kMaxWaiting) waiting_.pop_front();
  Datagram& out = waiting_.emplace_back();
  // An acknowledgement that the next one does not replace soon travels on the stream.
  out.size = input_.write(asBytes(message), nowUs, out.bytes, !outgoing.isAcknowledgement);
  return true;
}

Bytes DatagramLink::nextMessage(std::uint64_t nowUs) {
  message_ = order_.next(nowUs);
  if (!message_.empty()) return {message_.data(), message_.size()};
  while (const auto frame = assembly_.next(nowUs)) {
    const Bytes message = asMessage(frame->message);
    // Frames that were lost before the stream carried others have no effect any more.
    const bool isSure = !frame->afterGap || assembly_.statistics().lostFrames == lostBeforeStream_;
    if (order_.passes(message, isSure, nowUs)) return message;
    message_ = order_.next(nowUs);
    if (!message_.empty()) return {message_.data(), message_.size()};
  }
  return {};
}

std::span<const std::byte> DatagramLink::nextDatagram(std::uint64_t nowUs) {
  const auto written = [&](std::size_t size) { return std::span(datagram_.bytes).first(size); };
  if (!waiting_.empty()) {
    datagram_ = waiting_.front();
    waiting_.pop_front();
    return written(datagram_.size);
  }
  if (const auto repeatUs = input_.repeatUs(); repeatUs && nowUs >= *repeatUs)
    return written(input_.repeat(nowUs, datagram_.bytes));
  if (const auto request = assembly_.nextRequest(nowUs))
    return written(datagram::writeRequest(*request, datagram_.bytes));
  if (const auto due = received_.dueUs(); due && (completed_ || nowUs >= *due)) {
    completed_ = false;
    return written(datagram::writeReceipt(*received_.take(), datagram_.bytes));
  }
  return {};
}

Bytes DatagramLink::nextStreamMessage(std::uint64_t nowUs) {
  for (std::optional<Unsettled>* unsettled : {&poses_, &acknowledgement_})
    if (*unsettled && nowUs >= (*unsettled)->sentUs + kSettleUs) {
      message_ = std::exchange(*unsettled, std::nullopt)->message;
      return {message_.data(), message_.size()};
    }
  return {};
}

std::optional<std::uint64_t> DatagramLink::dueUs() const {
  std::optional<std::uint64_t> due;
  const auto include = [&](std::optional<std::uint64_t> us) {
    if (us) due = due ? std::min(*due, *us) : us;
  };
  include(assembly_.dueUs());
  include(order_.dueUs());
  include(received_.dueUs());
  include(input_.repeatUs());
  for (const std::optional<Unsettled>* unsettled : {&poses_, &acknowledgement_})
    if (*unsettled) include((*unsettled)->sentUs + kSettleUs);
  return due;
}

cs_datagram_statistics DatagramLink::statistics(std::uint64_t nowUs) const {
  const datagram::AssemblyStatistics& frames = assembly_.statistics();
  const std::uint64_t sent = packets_ > 0 ? newestPacket_ + 1 : 0;
  return {.version = CS_DATAGRAM_STATISTICS_VERSION,
          .in_use = inUse(nowUs) ? 1 : 0,
          .packets = packets_,
          .lost_packets = sent - std::min(packets_, sent),
          .parity_packets = parityPackets_,
          .frames = frames.frames,
          .repaired_frames = frames.repairedFrames,
          .lost_frames = frames.lostFrames,
          .requests = frames.requests,
          .held_frames = order_.heldFrames()};
}

}  // namespace clothstream::client
