// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "tests/codec/cut_grid.h"
#include "tests/codec/motion.h"

namespace clothstream::codec {
namespace {

// Squared distance of the vertex whose first coordinate has index i.
double squaredDistance(std::span<const float> a, std::span<const float> b, std::size_t i) {
  double squared = 0;
  for (std::size_t c = i; c < i + 3; ++c) {
    const double off = static_cast<double>(a[c]) - static_cast<double>(b[c]);
    squared += off * off;
  }
  return squared;
}

// Encoder and decoder of one stream.
class Loop {
 public:
  explicit Loop(const StreamLayout& layout, const EncoderOptions& options = {})
      : layout_(layout),
        encoder_(Encoder::make(layout, options)),
        decoder_(Decoder::make(layout)),
        packet_(encoder_->packetBound()) {}

  // Sends one frame and checks the decoded result.
  PacketHeader send(std::uint64_t tick, PacketKind kind, const MotionFrame& frame) {
    const std::size_t bytes = encoder_->encode(tick, kind, frame.positions, frame.normals, packet_);
    const std::span<const std::byte> packet = std::span(packet_).first(bytes);
    EXPECT_EQ(decoder_->decode(packet), DecodeResult::ok) << tick;
    EXPECT_EQ(decoder_->tick(), tick);
    EXPECT_EQ(decoder_->reconstructionHash(), encoder_->reconstructionHash()) << tick;
    expectPositions(tick, frame);
    if (layout_.normals == NormalMode::octahedral) expectNormals(frame);
    return parsePacket(packet)->header;
  }

  Encoder& encoder() { return *encoder_; }
  const Decoder& decoder() const { return *decoder_; }

 private:
  void expectPositions(std::uint64_t tick, const MotionFrame& frame) {
    const double maxError = static_cast<double>(layout_.maxError);
    const std::span<const float> decoded = decoder_->positions();
    for (std::size_t i = 0; i < frame.positions.size(); i += 3) {
      EXPECT_LE(squaredDistance(frame.positions, decoded, i), 3 * maxError * maxError)
          << "tick " << tick << " vertex " << i / 3;
    }
  }

  void expectNormals(const MotionFrame& frame) {
    constexpr double kLargestAngle = 1;  // bound of encodeOctahedral()
    for (std::size_t i = 0; i < frame.normals.size(); i += 3)
      EXPECT_LT(degreesBetween(&decoder_->normals()[i], &frame.normals[i]), kLargestAngle) << i;
  }

  StreamLayout layout_;
  std::unique_ptr<Encoder> encoder_;
  std::unique_ptr<Decoder> decoder_;
  std::vector<std::byte> packet_;
};

class ClosedLoop : public testing::TestWithParam<NormalMode> {
 protected:
  static StreamLayout mixed() { return mixedLayout(GetParam()); }
};
INSTANTIATE_TEST_SUITE_P(Normals, ClosedLoop, testing::Values(NormalMode::none, NormalMode::octahedral),
                         [](const auto& chosen) {
                           return chosen.param == NormalMode::none ? "none" : "octahedral";
                         });

TEST_P(ClosedLoop, KeepsMaxErrorOverAMotion) {
  const StreamLayout layout = mixed();
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

TEST_P(ClosedLoop, KeepsMaxErrorWhenEverythingJumps) {
  const StreamLayout layout = mixed();
  Loop loop(layout);
  for (std::uint32_t tick = 1; tick <= 30; ++tick) {
    loop.send(tick, PacketKind::predicted, scatter(layout, tick, tick % 3 == 0 ? 0.01f : 31.9f));
  }
}

TEST_P(ClosedLoop, KeepsSmallestAndLargestMaxError) {
  for (const float maxError : {kSmallestMaxError, 1e-5f, 2e-4f, 0.1f}) {
    StreamLayout layout = mixed();
    layout.maxError = maxError;
    Loop loop(layout);
    for (std::uint64_t tick = 1; tick <= 10; ++tick) {
      loop.send(tick, PacketKind::predicted, sampleMotion(layout, tick, 0.3f));
    }
    for (std::uint32_t tick = 11; tick <= 14; ++tick) {
      loop.send(tick, PacketKind::predicted, scatter(layout, tick, 31.9f));
    }
  }
}

TEST_P(ClosedLoop, AlwaysStartsWithAKeyFrame) {
  const StreamLayout layout = mixed();
  Loop loop(layout);
  EXPECT_EQ(loop.send(5, PacketKind::predicted, sampleMotion(layout, 5, 0.1f)).kind, PacketKind::key);
  EXPECT_EQ(loop.send(6, PacketKind::predicted, sampleMotion(layout, 6, 0.1f)).kind, PacketKind::predicted);
  loop.encoder().forgetHistory();
  EXPECT_EQ(loop.send(7, PacketKind::predicted, sampleMotion(layout, 7, 0.1f)).kind, PacketKind::key);
}

TEST_P(ClosedLoop, SurvivesPositionsThatAreNotFinite) {
  const StreamLayout layout = mixed();
  const auto encoder = Encoder::make(layout);
  const auto decoder = Decoder::make(layout);
  std::vector<std::byte> packet(encoder->packetBound());
  MotionFrame frame = sampleMotion(layout, 1, 0.1f);
  std::fill(frame.positions.begin() + 5, frame.positions.begin() + 40, std::nanf(""));
  std::fill(frame.positions.begin() + 40, frame.positions.begin() + 80, -INFINITY);
  for (std::uint64_t tick = 1; tick <= 3; ++tick) {
    const std::size_t bytes =
        encoder->encode(tick, PacketKind::predicted, frame.positions, frame.normals, packet);
    ASSERT_EQ(decoder->decode(std::span(packet).first(bytes)), DecodeResult::ok);
    EXPECT_EQ(decoder->reconstructionHash(), encoder->reconstructionHash());
    for (const float x : decoder->positions()) EXPECT_TRUE(std::isfinite(x));
  }
}

StreamLayout square(std::uint32_t edge) {
  return {.epoch = 1, .cloths = {{.vertexCount = edge * edge, .rows = edge, .columns = edge}}};
}

TEST(Hierarchical, SendsStillClothInATwentiethOfABitAVertex) {
  const StreamLayout layout = square(100);
  Loop loop(layout);
  PacketHeader last;
  for (std::uint64_t tick = 1; tick <= 40; ++tick) {
    last =
        loop.send(tick, PacketKind::predicted, sampleMotion(layout, std::min<std::uint64_t>(tick, 8), 0.05f));
  }
  std::size_t bits = 0;
  for (std::size_t i = 0; i < last.sectionCount; ++i) bits += std::size_t{8} * last.sectionBytes[i];
  EXPECT_LT(bits, 10'000 / 20);
}

StreamLayout cut(const CutGrid& mesh) {
  return {.epoch = 1, .cloths = {mesh.cloth()}};
}

std::size_t bodyBytes(const PacketHeader& header) {
  std::size_t sum = 0;
  for (std::size_t i = 0; i < header.sectionCount; ++i) sum += header.sectionBytes[i];
  return sum;
}

// Triangles alone let the codec do better than for a row of vertices. Rest positions bring it near the grid
// that the mesh was cut from.
TEST(Hierarchical, FindsMeshOrderFromTrianglesAndRestPositions) {
  CutGrid mesh(64);
  StreamLayout known = cut(mesh), noPositions = known;
  noPositions.cloths[0].restPositions.clear();
  StreamLayout noTriangles = noPositions;
  noTriangles.cloths[0].triangles.clear();
  const StreamLayout grid = square(64);
  Loop gridLoop(grid);
  std::array<Loop, 3> loops{Loop(known), Loop(noPositions), Loop(noTriangles)};
  std::size_t gridBytes = 0;
  std::array<std::size_t, 3> bytes{};
  for (std::uint64_t tick = 1; tick <= 20; ++tick) {
    MotionFrame frame = sampleMotion(grid, tick, 0.03f);
    gridBytes += bodyBytes(gridLoop.send(tick, PacketKind::predicted, frame));
    const std::span<const float> positions = mesh.renumbered(frame.positions);
    frame.positions.assign(positions.begin(), positions.end());
    for (std::size_t i = 0; i < loops.size(); ++i)
      bytes[i] += bodyBytes(loops[i].send(tick, PacketKind::predicted, frame));
  }
  EXPECT_LT(2 * bytes[0], 3 * gridBytes);
  EXPECT_LT(bytes[0], bytes[1]);
  EXPECT_LT(2 * bytes[1], bytes[2]);
}

TEST(Hierarchical, CodesMeshesOfAnyShape) {
  // A fan whose hub comes last, triangles without common vertices, a triangle that names one vertex three
  // times, and lone vertices.
  StreamLayout layout{.epoch = 2, .cloths = {}};
  ClothLayout fan{.vertexCount = 3001}, apart{.vertexCount = 300}, odd{.vertexCount = 40};
  for (std::uint32_t i = 0; i + 1 < 3000; ++i) fan.triangles.insert(fan.triangles.end(), {i, i + 1, 3000});
  for (std::uint32_t i = 0; i < 300; ++i) apart.triangles.push_back(i);
  odd.triangles = {5, 5, 5, 6, 7, 6};
  layout.cloths = {fan, apart, odd};
  Loop loop(layout);
  for (std::uint64_t tick = 1; tick <= 5; ++tick) {
    loop.send(tick, PacketKind::predicted, sampleMotion(layout, tick, 0.03f));
  }
}

TEST(Hierarchical, KeepsPinsStillInMovingCloth) {
  const StreamLayout layout = square(20);
  Loop loop(layout);
  std::vector<float> before;
  for (std::uint64_t tick = 1; tick <= 40; ++tick) {
    MotionFrame frame = sampleMotion(layout, tick, 0.05f);
    const MotionFrame start = sampleMotion(layout, 1, 0.05f);
    std::copy_n(start.positions.begin(), 3 * 20, frame.positions.begin());
    loop.send(tick, PacketKind::predicted, frame);
    const std::span<const float> decoded = loop.decoder().positions();
    const std::vector<float> pins(decoded.begin(), decoded.begin() + 3 * 20);
    if (tick > 10) {
      EXPECT_EQ(pins, before) << tick;
    }
    before = pins;
  }
}

TEST(Hierarchical, WeightLagCostsFewBits) {
  const StreamLayout layout = square(64);
  std::vector<std::size_t> bytes;
  for (const std::uint32_t lag : {0u, 1u, 3u}) {
    Loop loop(layout, {.weightLag = lag});
    bytes.push_back(0);
    for (std::uint64_t tick = 1; tick <= 60; ++tick) {
      // One key frame before the weights of the previous key frame are known, and one long after.
      const bool key = tick == 3 || tick == 30;
      const PacketHeader header =
          loop.send(tick, key ? PacketKind::key : PacketKind::predicted, sampleMotion(layout, tick, 0.03f));
      // The first frame has the weights from before the key frame; the weights of the next ones are not known
      // yet.
      const std::uint64_t sinceKey = tick < 3 ? tick - 1 : tick < 30 ? tick - 3 : tick - 30;
      if (sinceKey <= lag + 1) {
        EXPECT_EQ(header.sectionBytes[0] == 0, sinceKey > 1 && sinceKey <= lag) << tick;
      }
      for (std::size_t i = 0; i < header.sectionCount && tick > 10; ++i)
        bytes.back() += header.sectionBytes[i];
    }
  }
  EXPECT_NE(bytes[0], bytes[2]);
  EXPECT_LT(bytes[1], bytes[0] * 105 / 100);
  EXPECT_LT(bytes[2], bytes[0] * 110 / 100);
}

TEST(Hierarchical, SendsNextFrameOfStillClothInAFewBytes) {
  const StreamLayout layout = mixedLayout(NormalMode::none);
  Loop loop(layout);
  loop.send(1, PacketKind::key, sampleMotion(layout, 1, 0.1f));
  EXPECT_LT(bodyBytes(loop.send(2, PacketKind::predicted, sampleMotion(layout, 1, 0.1f))), 16u);
}

TEST(Hierarchical, PredictionSavesBitsInSlowMotion) {
  const StreamLayout layout = square(64);
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
  // A key frame takes a few bits for a coordinate that takes 32 bits as float32.
  EXPECT_LT(keyBytes, 19 * layout.vertexCount() * 12 / 8);
  EXPECT_LT(predictedBytes, keyBytes);
}

// The same scene in three qualities. A reader changes its quality only at key frames.
TEST(Hierarchical, ChangesQualityAtAKeyFrame) {
  StreamLayout layout = square(60);
  layout.qualities = 3;
  const auto decoder = Decoder::make(layout);
  std::vector<std::unique_ptr<Encoder>> encoders;
  for (std::uint8_t quality = 0; quality < layout.qualities; ++quality)
    encoders.push_back(Encoder::make(layout, {.quality = quality}));
  EXPECT_EQ(Encoder::make(layout, {.quality = layout.qualities}), nullptr);
  std::vector<std::byte> packet(encoders[0]->packetBound());
  std::array<std::size_t, 3> bytes{};
  double worst = 0;
  for (std::uint64_t tick = 1; tick <= 36; ++tick) {
    const MotionFrame frame = sampleMotion(layout, tick, 0.03f);
    const std::size_t wanted = tick / 6 % 3;
    for (std::size_t quality = 0; quality < 3; ++quality) {
      const bool key = quality == wanted && tick % 6 == 0;
      const std::size_t size = encoders[quality]->encode(tick, key ? PacketKind::key : PacketKind::predicted,
                                                         frame.positions, {}, packet);
      if (!key) bytes[quality] += size;
      if (quality != wanted) {
        // The packet refers to a frame of another quality, or is stale. Nothing is sent at a change of
        // quality.
        if (tick % 6 == 0) continue;
        EXPECT_NE(decoder->decode(std::span(packet).first(size)), DecodeResult::ok);
        continue;
      }
      const std::uint64_t hash = encoders[quality]->reconstructionHash();
      ASSERT_EQ(decoder->decode(std::span(packet).first(size)), DecodeResult::ok) << tick;
      EXPECT_EQ(decoder->reconstructionHash(), hash);
      for (std::size_t i = 0; i < frame.positions.size(); i += 3) {
        const double distance = std::sqrt(squaredDistance(frame.positions, decoder->positions(), i));
        const double promise =
            std::sqrt(3.0) * static_cast<double>(maxErrorOf(layout, static_cast<std::uint8_t>(quality)));
        ASSERT_LE(distance, promise);
        worst = std::max(worst, distance / promise);
      }
    }
  }
  EXPECT_GT(worst, 0.5);
  EXPECT_GT(bytes[0], bytes[1]);
  EXPECT_GT(bytes[1], bytes[2]);
}

TEST(Layout, IsRefusedIfImpossible) {
  const StreamLayout good = mixedLayout(NormalMode::none);
  ASSERT_NE(Decoder::make(good), nullptr);
  std::vector<StreamLayout> bad(18, good);
  bad[0].cloths.clear();
  bad[1].cloths[0].rows = 8;
  bad[2].cloths[0].rows = 0;
  bad[3].cloths[2].vertexCount = 0;
  bad[4].maxError = 0;
  bad[5].maxError = std::nanf("");
  bad[6].maxError = INFINITY;
  bad[7].cloths.assign(2, {.vertexCount = (1u << 25) + 1, .rows = 0, .columns = 0});
  bad[8].cloths.assign(1, {.vertexCount = 4, .rows = 0x80000002u, .columns = 2});  // 4 modulo 2^32
  bad[9].codec = 0;
  bad[10].codec = 1;
  bad[11].codec = 200;
  bad[12].cloths[0].restPositions.assign(3 * 63, 0);  // rest positions of a grid
  bad[13].qualities = 0;
  bad[14].qualities = kMaxQualities + 1;
  bad[15].codec = 3;
  bad[16].origin[1] = std::nanf("");
  bad[17].origin[2] = -1.1e6f;
  for (std::size_t i = 0; i < bad.size(); ++i) {
    EXPECT_EQ(Decoder::make(bad[i]), nullptr) << i;
    EXPECT_EQ(Encoder::make(bad[i]), nullptr) << i;
  }
}

}  // namespace
}  // namespace clothstream::codec
