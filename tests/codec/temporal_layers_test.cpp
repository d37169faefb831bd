// SPDX-License-Identifier: MIT
#include "proto/codec/temporal_layers.h"

#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "tests/codec/motion.h"

namespace clothstream::codec {
namespace {

struct Sent {
  std::vector<std::byte> bytes;
  PacketHeader header;
  std::uint64_t hash = 0;
};

StreamLayout layered(std::uint8_t layers) {
  return {.epoch = 3,
          .temporalLayers = layers,
          .cloths = {{.vertexCount = 30 * 20, .rows = 30, .columns = 20}, {.vertexCount = 12}}};
}

// The cloth moves, rests for a while, and moves again. `keys` are the ticks of key frames.
std::vector<Sent> send(const StreamLayout& layout, const std::set<std::uint64_t>& keys,
                       std::uint64_t frames) {
  const auto encoder = Encoder::make(layout);
  std::vector<std::byte> packet(encoder->packetBound());
  std::vector<Sent> sent;
  for (std::uint64_t tick = 1; tick <= frames; ++tick) {
    const std::uint64_t moment = tick < 20 ? tick : tick < 32 ? 20 : tick - 12;
    const MotionFrame frame = sampleMotion(layout, moment, 0.05f);
    const PacketKind kind = keys.contains(tick) ? PacketKind::key : PacketKind::predicted;
    const std::size_t bytes = encoder->encode(tick, kind, frame.positions, {}, packet);
    const std::span<const std::byte> whole = std::span(packet).first(bytes);
    sent.push_back({{whole.begin(), whole.end()}, parsePacket(whole)->header, encoder->reconstructionHash()});
  }
  return sent;
}

TEST(TemporalLayers, HalveTheRateEach) {
  const std::vector<int> three{0, 2, 1, 2, 0, 2, 1, 2}, two{0, 1, 0, 1};
  for (std::size_t i = 0; i < three.size(); ++i) EXPECT_EQ(layerOf(i, 3), three[i]);
  for (std::size_t i = 0; i < two.size(); ++i) EXPECT_EQ(layerOf(i, 2), two[i]);
  EXPECT_EQ(layerOf(7, 1), 0);
}

TEST(TemporalLayers, ReferToLowerLayersOrWithinTheBase) {
  for (std::uint8_t layers = 1; layers <= kMaxTemporalLayers; ++layers) {
    const std::vector<Sent> sent = send(layered(layers), {1, 27}, 60);
    std::size_t sinceKey = 0;
    for (const auto& [bytes, header, hash] : sent) {
      if (header.kind == PacketKind::key) sinceKey = 0;
      EXPECT_EQ(header.temporalLayer, layerOf(sinceKey++, layers));
      if (header.kind == PacketKind::key) continue;
      ASSERT_EQ(header.referenceCount, 1);
      const std::uint8_t below = sent[header.references[0] - 1].header.temporalLayer;
      EXPECT_TRUE(below < header.temporalLayer || (below == 0 && header.temporalLayer == 0)) << header.tick;
    }
  }
}

// A frame is decoded to the same bits whenever its reference was decoded, whatever else was dropped.
// Otherwise the decoder reports the missing reference at once.
void expectSameBits(const StreamLayout& layout, const std::vector<Sent>& sent,
                    const std::vector<bool>& leftOut) {
  const auto decoder = Decoder::make(layout);
  std::set<std::uint64_t> decoded;
  for (std::size_t i = 0; i < sent.size(); ++i) {
    if (leftOut[i]) continue;
    const auto& [bytes, header, hash] = sent[i];
    if (header.kind == PacketKind::key) decoded.clear();
    const bool possible = header.kind == PacketKind::key || decoded.contains(header.references[0]);
    ASSERT_EQ(decoder->decode(bytes), possible ? DecodeResult::ok : DecodeResult::missingReference)
        << header.tick;
    if (!possible) continue;
    EXPECT_EQ(decoder->tick(), header.tick);
    EXPECT_EQ(decoder->reconstructionHash(), hash) << header.tick;
    decoded.insert(header.tick);
  }
}

TEST(TemporalLayers, DroppedLayersDoNotChangeOthers) {
  for (std::uint8_t layers = 2; layers <= kMaxTemporalLayers; ++layers) {
    const StreamLayout layout = layered(layers);
    const std::vector<Sent> sent = send(layout, {1, 27}, 60);
    for (unsigned subset = 0; subset < 1u << layers; ++subset) {
      std::vector<bool> leftOut;
      for (const Sent& packet : sent) leftOut.push_back((subset >> packet.header.temporalLayer & 1u) != 0);
      expectSameBits(layout, sent, leftOut);
    }
  }
}

TEST(TemporalLayers, DecodeWithoutTheHighestLayers) {
  const StreamLayout layout = layered(3);
  const std::vector<Sent> sent = send(layout, {1, 27}, 60);
  for (std::uint8_t highest = 0; highest < 3; ++highest) {
    const auto decoder = Decoder::make(layout);
    for (const auto& [bytes, header, hash] : sent) {
      if (header.temporalLayer > highest) continue;
      ASSERT_EQ(decoder->decode(bytes), DecodeResult::ok);
      EXPECT_EQ(decoder->reconstructionHash(), hash);
    }
  }
}

TEST(TemporalLayers, DroppedFramesDoNotChangeOthers) {
  const StreamLayout layout = layered(3);
  const std::vector<Sent> sent = send(layout, {1, 27}, 60);
  std::uint32_t random = 1;
  for (int round = 0; round < 50; ++round) {
    std::vector<bool> leftOut;
    for (const Sent& packet : sent) {
      random = random * 1664525 + 1013904223;
      leftOut.push_back(packet.header.temporalLayer == 0 ? random < 1u << 28 : random < 1u << 30);
    }
    expectSameBits(layout, sent, leftOut);
  }
}

TEST(TemporalLayers, KeyFrameHealsLossOfABaseFrame) {
  const StreamLayout layout = layered(3);
  const std::vector<Sent> sent = send(layout, {1, 27}, 40);
  const auto decoder = Decoder::make(layout);
  bool lost = false;
  for (const auto& [bytes, header, hash] : sent) {
    if (header.tick == 9) {  // a base frame
      ASSERT_EQ(header.temporalLayer, 0);
      lost = true;
      continue;
    }
    if (header.kind == PacketKind::key) lost = false;
    ASSERT_EQ(decoder->decode(bytes), lost ? DecodeResult::missingReference : DecodeResult::ok)
        << header.tick;
    if (!lost) {
      EXPECT_EQ(decoder->reconstructionHash(), hash);
    }
  }
}

TEST(TemporalLayers, AreRefusedIfNotInTheLayout) {
  const StreamLayout layout = layered(2);
  const std::vector<Sent> sent = send(layered(3), {1}, 4);
  const auto decoder = Decoder::make(layout);
  ASSERT_EQ(decoder->decode(sent[0].bytes), DecodeResult::ok);
  EXPECT_EQ(decoder->decode(sent[1].bytes), DecodeResult::malformed);
  EXPECT_EQ(decoder->tick(), 1u);
  std::vector<std::byte> key = sent[0].bytes;
  key[4] = std::byte{1};
  EXPECT_EQ(Decoder::make(layout)->decode(key), DecodeResult::malformed);
}

}  // namespace
}  // namespace clothstream::codec
