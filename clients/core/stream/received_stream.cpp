// SPDX-License-Identifier: MIT
#include "clients/core/stream/received_stream.h"

#include <algorithm>
#include <utility>

#include "proto/codec/packet_header.h"

namespace clothstream::client {

void ReceivedStream::connecting() {
  assembly_ = {};
  keyFrameRequest_ = {};
}

void ReceivedStream::welcomed() {
  quality_ = 0;
  frameDivisor_ = 1;
  acknowledgements_.begin();
}

tl::expected<bool, std::string> ReceivedStream::add(const Chunk& chunk, const Limits& limits, bool resumed) {
  auto content = assembly_.add(chunk, limits.contentBytes);
  if (!content)
    return tl::make_unexpected("The server sent a wrong description: " + std::move(content.error()) + ".");
  if (!*content) return false;
  auto description = readDescription(**content, limits);
  if (!description)
    return tl::make_unexpected(
        "The server's description of the scene is wrong: " + std::move(description.error()) + ".");
  if (!newest_.begin(description->layout))
    return tl::make_unexpected("The server's description of the scene is wrong: its layout is not possible.");
  description_ = std::move(*description);
  keyFrameRequest_.answered();
  // After a resume the ticks continue, so frames missed during the outage count as dropped.
  if (!resumed) statistics_.forgetTicks();
  report_ = {};
  return true;
}

tl::expected<ReceivedStream::Received, const char*> ReceivedStream::receive(Bytes body,
                                                                            const cs_decoded* decoded,
                                                                            std::uint64_t nowUs) {
  if (!readFrame(body, frame_)) return tl::make_unexpected("Frame");
  description_.colliders.resize(frame_.colliders.size());
  for (std::size_t i = 0; i < frame_.colliders.size(); ++i) {
    if (!readCollider(frame_.colliders[i], description_.colliders[i]))
      return tl::make_unexpected("ColliderState");
  }
  Received received = decode(decoded, nowUs);
  if (!frame_.report || !received.isNew) return received;
  if (!readsReport(*frame_.report)) return tl::make_unexpected("SimulationReport");
  received.hasReport = true;
  return received;
}

ReceivedStream::Received ReceivedStream::decode(const cs_decoded* given, std::uint64_t nowUs) {
  const auto packet = std::as_bytes(std::span(frame_.packet.data(), frame_.packet.size()));
  const auto parsed = codec::parsePacket(packet);
  // Frames that the server omits are not lost. At a change of the divisor, the larger distance between frames
  // counts.
  statistics_.arrived(parsed ? std::optional(parsed->header.tick) : std::nullopt, packet.size(),
                      description_.ticksPerFrame() * std::max(frameDivisor_, frame_.divisor), nowUs);
  frameDivisor_ = frame_.divisor;
  const bool isMirror = newest_.isMirror();
  const cs_decoding decoding = !isMirror ? newest_.decode(packet)
                               : parsed  ? newest_.take(given, parsed->header.tick)
                                         : CS_DECODING_REFUSED;
  if (decoding == CS_DECODING_SKIPPED) return {};
  if (decoding == CS_DECODING_REFUSED) {
    statistics_.refused();
    return {.needsKeyFrame = !isMirror};
  }
  const DecodedFrame decoded{
      .tick = newest_.tick(),
      .key = parsed->header.kind == codec::PacketKind::key,
      .hashMatches = newest_.hash() == frame_.reconstructionHash,
      .vertexCount = description_.layout.vertexCount(),
      .packetBytes = packet.size(),
  };
  statistics_.decoded(decoded, nowUs);
  if (decoded.key) keyFrameRequest_.answered();
  // A key frame makes the client's state equal to the server's again.
  return {.isNew = true, .isKey = decoded.key, .needsKeyFrame = !isMirror && !decoded.hashMatches};
}

bool ReceivedStream::readsReport(Bytes body) {
  if (!readReport(body, report_)) return false;
  reportTick_ = newest_.tick();
  const std::span<const codec::ClothLayout> cloths = description_.layout.cloths;
  for (std::size_t i = 0; i < report_.cloths.size(); ++i) {
    const std::vector<std::uint32_t>& ends = report_.cloths[i].constraintEnds;
    const std::uint32_t vertices = i < cloths.size() ? cloths[i].vertexCount : 0;
    if (ends.size() % 2 != 0 ||
        std::any_of(ends.begin(), ends.end(), [&](auto end) { return end >= vertices; }))
      return false;
  }
  return true;
}

bool ReceivedStream::takeKeyFrameRequest(std::uint64_t nowUs, bool always) {
  return keyFrameRequest_.wanted(nowUs) || always;
}

void ReceivedStream::measure(const ServerClock& clock, std::uint64_t nowUs) {
  stages_ = {};
  if (!clock.known()) return;
  const std::uint64_t arrivedUs = clock.serverTimeUs(nowUs);
  stages_.server_ms = since(frame_.tickTimeUs, frame_.packetTimeUs) / 1000;
  stages_.network_ms = since(frame_.packetTimeUs, arrivedUs) / 1000;
  stages_.displayable_ms = since(frame_.tickTimeUs, arrivedUs) / 1000 + newest_.decodeMs();
}

DisplayableFrame ReceivedStream::displayable(bool isKey) const {
  const bool sendsNormals = description_.layout.normals != codec::NormalMode::none;
  return {.tick = newest_.tick(),
          .timeUs = frame_.tickTimeUs,
          .key = isKey,
          .positions = newest_.positions(),
          .normals = sendsNormals ? newest_.normals() : std::span<const float>(),
          .colliders = description_.colliders};
}

std::span<const float> ReceivedStream::positions() const {
  return newest_.present() ? newest_.positions() : std::span<const float>(description_.restPositions);
}

std::span<const float> ReceivedStream::normals() const {
  return newest_.present() ? newest_.normals() : std::span<const float>(description_.restNormals);
}

cs_stage_statistics ReceivedStream::stages() const {
  cs_stage_statistics stages = stages_;
  stages.version = CS_STAGE_STATISTICS_VERSION;
  stages.decode_ms = newest_.decodeMs();
  return stages;
}

}  // namespace clothstream::client
