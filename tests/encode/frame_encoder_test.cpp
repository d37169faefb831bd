// SPDX-License-Identifier: MIT
// The encoder on the device against the reference encoder on the CPU: the same packets, to the bit.
#include "server/encode/frame_encoder.h"

#include <cmath>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "server/encode/quality_encoders.h"
#include "tests/encode/encoding.h"

namespace clothstream::tests {
namespace {

struct Sort {
  const char* name;
  model::Normals normals;
  encode::Prediction prediction = encode::Prediction::onHost;
};

class FrameEncoder : public GpuTest, public testing::WithParamInterface<Sort> {};
INSTANTIATE_TEST_SUITE_P(Sorts, FrameEncoder,
                         testing::Values(Sort{"onHost", model::Normals::none},
                                         Sort{"onHostWithNormals", model::Normals::octahedral},
                                         Sort{"onDevice", model::Normals::none, encode::Prediction::onDevice},
                                         Sort{"onDeviceWithNormals", model::Normals::octahedral,
                                              encode::Prediction::onDevice}),
                         [](const auto& chosen) { return chosen.param.name; });

TEST_P(FrameEncoder, MakesThePacketsOfTheReferenceEncoder) {
  Encoding encoding(clothsOf(GetParam().normals), GetParam().prediction);
  for (std::uint64_t tick = 1; tick <= 120; ++tick) {
    const encode::RecordedFrame frame = encoding.tick(tick, tick % 40 == 0);
    EXPECT_EQ(frame.kind == codec::PacketKind::key, tick == 1 || tick % 40 == 0) << tick;
    if (testing::Test::HasFailure()) break;
  }
  // It moved: a still cloth would take some 20 bytes a frame.
  EXPECT_GT(encoding.kilobytes(), 120 * 0.1);
}

TEST_P(FrameEncoder, EqualsTheReferenceOnStatesOfEverySize) {
  Encoding encoding(clothsOf(GetParam().normals), GetParam().prediction);
  std::mt19937 random(1);
  for (std::uint64_t tick = 1; tick <= 12; ++tick) {
    const float extents[] = {1e-19f, 0.001f, 1, 32, 8000, 1e6f};
    std::uniform_real_distribution<float> anywhere(-extents[tick % 6], extents[tick % 6]);
    simulation::NodeState state;
    for (std::uint32_t i = 0; i < encoding.simulation.nodeCount(); ++i) {
      state.positions.emplace_back(anywhere(random), anywhere(random), anywhere(random));
      state.velocities.emplace_back(0, 0, 0);
    }
    encoding.encodeState(state, tick, tick % 5 == 0);
  }
}

TEST_P(FrameEncoder, KeepsTheErrorAtTheEdgesOfRounding) {
  // Positions halfway between lattice points and the floats next to them, where a device with other rounding
  // would differ.
  Encoding encoding(clothsOf(GetParam().normals), GetParam().prediction);
  const float step = 2 * encoding.layout.maxError - 0x1p-18f;
  std::mt19937 random(2);
  std::uniform_int_distribution<int> point(-30000, 30000), offset(-3, 3);
  const auto edge = [&] {
    float x = (static_cast<float>(point(random)) + 0.5f) * step;
    for (int k = offset(random); k != 0; k += k < 0 ? 1 : -1) x = std::nextafter(x, k < 0 ? -100.0f : 100.0f);
    return x;
  };
  for (std::uint64_t tick = 1; tick <= 10; ++tick) {
    simulation::NodeState state;
    for (std::uint32_t i = 0; i < encoding.simulation.nodeCount(); ++i) {
      state.positions.emplace_back(edge(), edge(), edge());
      state.velocities.emplace_back(0, 0, 0);
    }
    encoding.encodeState(state, tick, false);
  }
}

// The decoder adds the origin, near which simulation and encoder work.
TEST_P(FrameEncoder, KeepsTheErrorFarFromTheOriginOfTheWorld) {
  model::Scene scene = clothsOf(GetParam().normals);
  for (model::Cloth& cloth : scene.cloths) cloth.grid.pose.position += model::Vec3(700, -300, 90);
  Encoding encoding(scene, GetParam().prediction);
  EXPECT_NE(encoding.simulation.origin(), model::Vec3::Zero());
  for (std::uint64_t tick = 1; tick <= 30; ++tick) encoding.tick(tick, tick % 10 == 1, inputsOf(scene));
}

TEST_P(FrameEncoder, MakesThePacketsOfMeshes) {
  model::Scene scene = clothsOf(GetParam().normals);
  scene.cloths.insert(scene.cloths.begin() + 1, discCloth(9));
  Encoding encoding(scene, GetParam().prediction);
  for (std::uint64_t tick = 1; tick <= 30 && !testing::Test::HasFailure(); ++tick)
    encoding.tick(tick, tick % 10 == 0);
}

class FrameEncoderSlots : public GpuTest {};

TEST_F(FrameEncoderSlots, AreFreedByEntropyCodingOnAnotherThread) {
  const model::Scene scene = clothsOf(model::Normals::none);
  Encoding encoding(scene);
  vulkan::Recorder recorder(device());
  std::vector<encode::RecordedFrame> frames;
  for (std::uint64_t tick = 1; encoding.encoder.canRecord(); ++tick) {
    ASSERT_LE(frames.size(), encode::FrameEncoder::kSlots);
    recorder.begin();
    encoding.simulation.recordTick(recorder, inputsOf(scene, sphereAt(tick)));
    frames.push_back(encoding.encoder.record(recorder, tick, false));
    submitAndWait(device(), recorder);
  }
  ASSERT_EQ(frames.size(), encode::FrameEncoder::kSlots);

  std::vector<std::vector<std::byte>> packets(frames.size());
  std::thread publisher([&] {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      packets[i].resize(encoding.encoder.packetBound());
      packets[i].resize(encoding.encoder.entropyCode(frames[i], packets[i]).bytes);
    }
  });
  publisher.join();
  EXPECT_TRUE(encoding.encoder.canRecord());
  const auto decoder = codec::Decoder::make(encoding.layout);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(decoder->decode(packets[i]), codec::DecodeResult::ok) << i;
    EXPECT_EQ(decoder->tick(), frames[i].tick);
  }
}

TEST_F(FrameEncoderSlots, AFrameAfterForgettingIsAKeyFrame) {
  Encoding encoding(clothsOf(model::Normals::none));
  EXPECT_EQ(encoding.tick(1, false).kind, codec::PacketKind::key);
  EXPECT_EQ(encoding.tick(2, false).kind, codec::PacketKind::predicted);
  encoding.encoder.forgetHistory();
  EXPECT_EQ(encoding.tick(3, false).kind, codec::PacketKind::key);
  EXPECT_EQ(encoding.tick(4, false).referenceTick, 3u);
}

class QualityEncoders : public GpuTest {};

TEST_F(QualityEncoders, DroppingDoesNotWaitForAnEncoderThatIsBeingCreated) {
  using Clock = encode::QualityEncoders::Clock;
  model::Scene scene = sceneOf({calmCloth(500, 500)});
  scene.stream.qualities = 2;
  const simulation::ClothSimulation simulation(device(), scene);
  const codec::StreamLayout layout = encode::streamLayout(scene, kEpoch);
  encode::QualityEncoders encoders(device(), simulation, layout, nullptr);
  const Clock::time_point before = Clock::now();
  const auto alone = codec::Encoder::make(layout, {.quality = 1});
  const Clock::duration creation = Clock::now() - before;

  EXPECT_EQ(encoders.wanted(1, Clock::now()), nullptr);
  const Clock::time_point dropped = Clock::now();
  encoders.drop();
  EXPECT_LT(Clock::now() - dropped, creation / 2);
  // The encoder is there when the quality is needed again.
  while (encoders.wanted(1, Clock::now()) == nullptr) std::this_thread::yield();
}

}  // namespace
}  // namespace clothstream::tests
