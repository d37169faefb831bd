// SPDX-License-Identifier: MIT
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "proto/codec/octahedral.h"
#include "tests/codec/motion.h"

namespace clothstream::codec {
namespace {

// Encoder and decoder of one stream.
class Loop {
 public:
  explicit Loop(const StreamLayout& layout)
      : layout_(layout),
        encoder_(Encoder::make(layout)),
        decoder_(Decoder::make(layout)),
        packet_(encoder_->packetBound()) {}

  // Sends one frame and checks what arrives.
  PacketHeader send(std::uint64_t tick, PacketKind kind, const MotionFrame& frame) {
    const std::size_t bytes = encoder_->encode(tick, kind, frame.positions, frame.normals, packet_);
    const std::span<const std::byte> packet = std::span(packet_).first(bytes);
    EXPECT_EQ(decoder_->decode(packet), DecodeResult::ok) << tick;
    EXPECT_EQ(decoder_->tick(), tick);
    EXPECT_EQ(decoder_->reconstructionHash(), encoder_->reconstructionHash()) << tick;
    for (std::size_t i = 0; i < frame.positions.size(); ++i) {
      const double error =
          static_cast<double>(frame.positions[i]) - static_cast<double>(decoder_->positions()[i]);
      EXPECT_LE(std::fabs(error), static_cast<double>(layout_.maxError))
          << "tick " << tick << " coordinate " << i;
    }
    if (layout_.normals == NormalMode::octahedral) expectNormals(frame);
    return parsePacket(packet)->header;
  }

  Encoder& encoder() { return *encoder_; }

 private:
  void expectNormals(const MotionFrame& frame) {
    for (std::size_t i = 0; i < frame.normals.size(); i += 3) {
      float sent[3];
      decodeOctahedral(encodeOctahedral(&frame.normals[i]), sent);
      for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(decoder_->normals()[i + c], sent[c]) << i;
    }
  }

  StreamLayout layout_;
  std::unique_ptr<Encoder> encoder_;
  std::unique_ptr<Decoder> decoder_;
  std::vector<std::byte> packet_;
};

class ClosedLoop : public testing::TestWithParam<NormalMode> {};
INSTANTIATE_TEST_SUITE_P(Normals, ClosedLoop, testing::Values(NormalMode::none, NormalMode::octahedral),
                         [](const auto& chosen) {
                           return chosen.param == NormalMode::none ? "none" : "octahedral";
                         });

TEST_P(ClosedLoop, KeepsTheMaxErrorOverAMotion) {
  const StreamLayout layout = mixedLayout(GetParam());
  Loop loop(layout);
  for (std::uint64_t tick = 1; tick <= 60; ++tick) {
    const bool key = tick % 20 == 1;
    const PacketHeader header = loop.send(tick * 3, key ? PacketKind::key : PacketKind::predicted,
                                          sampleMotion(layout, tick, 0.05f * static_cast<float>(tick % 7)));
    EXPECT_EQ(header.kind, key ? PacketKind::key : PacketKind::predicted);
    EXPECT_EQ(header.referenceCount, key ? 0 : 1);
    if (!key) {
      EXPECT_EQ(header.references[0], tick * 3 - 3);
    }
  }
}

TEST_P(ClosedLoop, KeepsTheMaxErrorWhenEverythingJumps) {
  const StreamLayout layout = mixedLayout(GetParam());
  Loop loop(layout);
  for (std::uint32_t tick = 1; tick <= 30; ++tick) {
    loop.send(tick, PacketKind::predicted, scatter(layout, tick, tick % 3 == 0 ? 0.01f : 31.9f));
  }
}

TEST_P(ClosedLoop, KeepsTheMaxErrorAtTheFinestAndAtTheCoarsest) {
  for (const float maxError : {1e-5f, 0.1f}) {
    StreamLayout layout = mixedLayout(GetParam());
    layout.maxError = maxError;
    Loop loop(layout);
    for (std::uint64_t tick = 1; tick <= 10; ++tick) {
      loop.send(tick, PacketKind::predicted, sampleMotion(layout, tick, 0.3f));
    }
  }
}

TEST(ClosedLoopKinds, StartsWithAKeyFrameWhateverIsAsked) {
  const StreamLayout layout = mixedLayout(NormalMode::none);
  Loop loop(layout);
  EXPECT_EQ(loop.send(5, PacketKind::predicted, sampleMotion(layout, 5, 0.1f)).kind, PacketKind::key);
  EXPECT_EQ(loop.send(6, PacketKind::predicted, sampleMotion(layout, 6, 0.1f)).kind, PacketKind::predicted);
  loop.encoder().forgetHistory();
  EXPECT_EQ(loop.send(7, PacketKind::predicted, sampleMotion(layout, 7, 0.1f)).kind, PacketKind::key);
}

TEST(ClosedLoopKinds, SendsAStillClothInAFewBytes) {
  const StreamLayout layout = mixedLayout(NormalMode::none);
  Loop loop(layout);
  loop.send(1, PacketKind::key, sampleMotion(layout, 1, 0.1f));
  const PacketHeader header = loop.send(2, PacketKind::predicted, sampleMotion(layout, 1, 0.1f));
  EXPECT_EQ(header.sectionCount, 1);
  EXPECT_EQ(header.sectionBytes[0], 2u);
}

TEST(ClosedLoopKinds, PredictionPaysOnASlowMotion) {
  const StreamLayout layout{.epoch = 1, .cloths = {{.vertexCount = 64 * 64, .rows = 64, .columns = 64}}};
  const auto predicted = Encoder::make(layout), keys = Encoder::make(layout);
  std::vector<std::byte> packet(keys->packetBound());
  std::size_t predictedBytes = 0, keyBytes = 0;
  for (std::uint64_t tick = 1; tick <= 20; ++tick) {
    const MotionFrame frame = sampleMotion(layout, tick, 0.003f);
    const std::size_t bytes = predicted->encode(tick, PacketKind::predicted, frame.positions, {}, packet);
    if (tick > 1) predictedBytes += bytes;
    const std::size_t keyFrame = keys->encode(tick, PacketKind::key, frame.positions, {}, packet);
    if (tick > 1) keyBytes += keyFrame;
  }
  // A key frame spends a few bits a coordinate where float32 spends 32.
  EXPECT_LT(keyBytes, 19 * layout.vertexCount() * 12 / 8);
  EXPECT_LT(predictedBytes, keyBytes);
}

TEST(Layout, ThatIsImpossibleMakesNoCodec) {
  const StreamLayout good = mixedLayout(NormalMode::none);
  ASSERT_NE(Decoder::make(good), nullptr);
  std::vector<StreamLayout> bad(9, good);
  bad[0].cloths.clear();
  bad[1].cloths[0].rows = 8;
  bad[2].cloths[0].rows = 0;
  bad[3].cloths[2].vertexCount = 0;
  bad[4].maxError = 0;
  bad[5].maxError = std::nanf("");
  bad[6].maxError = INFINITY;
  bad[7].cloths.assign(2, {.vertexCount = (1u << 25) + 1, .rows = 0, .columns = 0});
  bad[8].cloths.assign(1, {.vertexCount = 4, .rows = 0x80000002u, .columns = 2});  // 4 modulo 2^32
  for (std::size_t i = 0; i < bad.size(); ++i) {
    EXPECT_EQ(Decoder::make(bad[i]), nullptr) << i;
    EXPECT_EQ(Encoder::make(bad[i]), nullptr) << i;
  }
}

}  // namespace
}  // namespace clothstream::codec
