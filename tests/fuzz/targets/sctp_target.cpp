// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/sctp_target.h"

#include <algorithm>
#include <vector>

#include "inputs.pb.h"
#include "proto/sctp/data_channel.h"

namespace clothstream::fuzz {
namespace {

using Bytes = std::vector<std::byte>;

constexpr int kMaxSteps = 256;
constexpr std::uint32_t kOwnTag = 1, kPeerTag = 2;
constexpr std::uint32_t kOwnTsn = 1, kPeerTsn = 1;

std::span<const std::byte> viewOf(const std::string& text) {
  return std::as_bytes(std::span(text));
}

// Chunks that do not fit into one packet are left out.
Bytes packetOf(const SctpInput::Packet& input) {
  sctp::PacketWriter writer;
  writer.start(input.tag());
  bool any = false;
  for (const SctpInput::Chunk& chunk : input.chunks()) {
    if (!writer.fits(chunk.value().size())) break;
    const auto value = writer.add(static_cast<sctp::ChunkType>(chunk.type()),
                                  static_cast<std::uint8_t>(chunk.flags()), chunk.value().size());
    std::ranges::copy(viewOf(chunk.value()), value.begin());
    any = true;
  }
  if (!any) return {};
  const auto packet = writer.finish(true);
  return {packet.begin(), packet.end()};
}

class Peer {
 public:
  void run(const SctpInput& input) {
    if (input.connects()) channel_.connect(now_);
    if (input.established()) establish();
    int steps = 0;
    for (const SctpInput::Step& step : input.steps()) {
      if (++steps > kMaxSteps) break;
      pass(std::chrono::milliseconds(std::min(step.milliseconds(), 10'000u)));
      act(step);
    }
    pass(std::chrono::minutes(1));
    require(channel_.deadline() == sctp::kNever, "timers end without a peer");
  }

 private:
  // A handshake in which the peer connects.
  void establish() {
    const sctp::Init init{.tag = kPeerTag,
                          .window = 1 << 17,
                          .outgoingStreams = 8,
                          .incomingStreams = 8,
                          .tsn = kPeerTsn,
                          .forwardTsn = true,
                          .reconfig = true};
    sctp::PacketWriter writer;
    writer.start(0);
    sctp::writeInit(writer.add(sctp::ChunkType::init, 0, sctp::initBytes(init)), init);
    channel_.receive(now_, writer.finish(false));
    writer.start(kOwnTag);
    std::ranges::copy(cookie_, writer.add(sctp::ChunkType::cookieEcho, 0, cookie_.size()).begin());
    channel_.receive(now_, writer.finish(false));
    require(!channel_.isClosed(), "a right handshake is accepted");
  }

  void act(const SctpInput::Step& step) {
    switch (step.action_case()) {
      case SctpInput::Step::kRaw:
        receive(viewOf(step.raw()));
        break;
      case SctpInput::Step::kPacket:
        receive(packetOf(step.packet()));
        break;
      case SctpInput::Step::kSend: {
        const Bytes payload(step.send() % (2 * sctp::kMaxPayloadBytes));
        const bool wasOpen = channel_.isOpen();
        const sctp::SendResult result = channel_.send(now_, payload, step.send() % 2 == 0);
        require(result != sctp::SendResult::sent || wasOpen, "messages leave through an open channel");
        break;
      }
      case SctpInput::Step::ACTION_NOT_SET:
        break;
    }
  }

  void receive(std::span<const std::byte> packet) {
    sentBytes_ = 0;
    channel_.receive(now_, packet);
    require(sentBytes_ <= 4 * packet.size() + 4096, "a packet causes few bytes");
    require(!(channel_.isOpen() && channel_.isClosed()), "a channel is open or closed");
    require(channel_.isClosed() == !channel_.closeReason().empty(), "a closed channel has a reason");
  }

  void pass(sctp::Duration duration) {
    const sctp::Time end = now_ + duration;
    while (channel_.deadline() <= end) {
      now_ = std::max(now_, channel_.deadline());
      channel_.advance(now_);
      require(channel_.deadline() > now_, "what is due is done");
    }
    now_ = end;
  }

  void checkSent(std::span<const std::byte> bytes) {
    sentBytes_ += bytes.size();
    require(bytes.size() <= sctp::kMaxSentBytes, "packets fit");
    const auto packet = sctp::parsePacket(bytes);
    require(packet.has_value(), "packets have a right header");
    std::span<const std::byte> rest = packet->chunks;
    while (!rest.empty()) {
      const auto chunk = sctp::takeChunk(rest);
      require(chunk.has_value(), "packets consist of chunks");
      if (chunk->type == sctp::ChunkType::data) require(sctp::parseData(*chunk).has_value(), "DATA is whole");
      if (chunk->type == sctp::ChunkType::sack) require(sctp::parseSack(*chunk).has_value(), "SACK is right");
      if (chunk->type == sctp::ChunkType::initAck) {
        const auto init = sctp::parseInit(*chunk);
        require(init.has_value(), "INIT ACK can be read");
        cookie_.assign(init->cookie.begin(), init->cookie.end());
      }
    }
  }

  sctp::Time now_ = sctp::Time{} + std::chrono::hours(1);
  std::size_t sentBytes_ = 0;
  Bytes cookie_;
  sctp::DataChannel channel_{{.label = "frames", .association = {.tag = kOwnTag, .firstTsn = kOwnTsn}},
                             [this](std::span<const std::byte> packet) { checkSent(packet); },
                             [](std::span<const std::byte> message) {
                               require(!message.empty() && message.size() <= sctp::kMaxReceivedBytes,
                                       "messages have a size");
                             }};
};

void run(const SctpInput& input) {
  Peer().run(input);
}

}  // namespace

const Target kSctpTarget{
    .name = "sctp", .run = &runStructured<SctpInput, &run>, .structure = &SctpInput::default_instance()};

}  // namespace clothstream::fuzz
