// SPDX-License-Identifier: MIT
// The encoder on the device against the reference encoder on the CPU: the same packets, to the bit.
#include "server/encode/frame_encoder.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "shaders/shared/types.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

constexpr std::uint32_t kEpoch = 3;

// Three cloths of odd sizes that hang by their top rows or fall.
scene::Scene clothsOf(scene::Normals normals) {
  scene::Cloth hanging = calmCloth(17, 23), strip = calmCloth(2, 5), falling = calmCloth(9, 8);
  hanging.name = "hanging";
  strip.name = "strip";
  falling.name = "falling";
  strip.grid.pose.position = {1, 0, 0};
  falling.grid.pose.position = {0, 1, 0.3f};
  hanging.pins = {topRow(hanging)};
  scene::Scene scene = sceneOf({hanging, strip, falling});
  scene.stream.normals = normals;
  return scene;
}

std::vector<simulation::MovingCollider> sphereAt(std::uint64_t tick) {
  const auto z = [](std::uint64_t t) { return -0.5f + 0.01f * static_cast<float>(t); };
  simulation::MovingCollider sphere;
  sphere.shape = scene::Sphere{0.08f};
  sphere.start.position = {0, -0.15f, z(tick)};
  sphere.end.position = {0, -0.15f, z(tick + 1)};
  return {sphere};
}

// A simulation whose frames are encoded on the device and on the CPU.
class Encoding {
 public:
  explicit Encoding(const scene::Scene& scene, std::optional<std::uint8_t> codec = {},
                    encode::Prediction prediction = encode::Prediction::automatic)
      : scene_(scene),
        simulation(device(), scene),
        layout(layoutOf(scene, codec)),
        encoder(device(), simulation, layout, prediction),
        recorder_(device()),
        normals_(device(), vulkan::BufferPurpose::readback, simulation.normals().bytes()),
        reference_(codec::Encoder::make(
            layout, {.weightLag = prediction == encode::Prediction::onDevice ? encode::kWeightLag : 0})),
        decoder_(codec::Decoder::make(layout)),
        packet_(encoder.packetBound()),
        expected_(reference_->packetBound()) {}

  // Advances, encodes both ways, decodes, and compares.
  encode::RecordedFrame tick(std::uint64_t tick, bool forceKey) {
    recorder_.begin();
    simulation.recordTick(recorder_, inputsOf(scene_, sphereAt(tick)));
    return encodeAndCompare(tick, forceKey);
  }

  encode::RecordedFrame encodeState(const simulation::NodeState& state, std::uint64_t tick, bool forceKey) {
    recorder_.begin();
    simulation.recordRestoreState(recorder_, simulation::pack(state, tick));
    return encodeAndCompare(tick, forceKey);
  }

  static codec::StreamLayout layoutOf(const scene::Scene& scene, std::optional<std::uint8_t> codec) {
    codec::StreamLayout layout = encode::streamLayout(scene, kEpoch);
    layout.codec = codec.value_or(layout.codec);
    return layout;
  }

  double kilobytes() const { return bytes_ / 1000; }

 private:
  encode::RecordedFrame encodeAndCompare(std::uint64_t tick, bool forceKey) {
    simulation.recordNormals(recorder_);
    const encode::RecordedFrame frame = encoder.record(recorder_, tick, forceKey);
    simulation.recordSaveState(recorder_);
    recorder_.copy(simulation.normals(), normals_, normals_.bytes());
    submitAndWait(device(), recorder_);
    const encode::EncodedFrame encoded = encoder.entropyCode(frame, packet_);
    compare(frame, encoded);
    return frame;
  }

  void compare(const encode::RecordedFrame& frame, const encode::EncodedFrame& encoded) {
    std::vector<float> positions, normals;
    for (const scene::Vec3& p : simulation::unpack(simulation.collectState(frame.tick)).positions) {
      positions.insert(positions.end(), {p.x(), p.y(), p.z()});
    }
    for (const shared::vec4& n : normals_.mapped<shared::vec4>())
      normals.insert(normals.end(), {n.x, n.y, n.z});
    const std::size_t expectedBytes =
        reference_->encode(frame.tick, frame.kind, positions, normals, expected_);
    const auto packet = std::span<const std::byte>(packet_).first(encoded.bytes);
    EXPECT_TRUE(std::ranges::equal(packet, std::span<const std::byte>(expected_).first(expectedBytes)))
        << "tick " << frame.tick;
    EXPECT_EQ(encoded.reconstructionHash, reference_->reconstructionHash()) << "tick " << frame.tick;

    ASSERT_EQ(decoder_->decode(packet), codec::DecodeResult::ok) << "tick " << frame.tick;
    EXPECT_EQ(decoder_->reconstructionHash(), encoded.reconstructionHash);
    bytes_ += static_cast<double>(encoded.bytes);
    // Each coordinate is promised by codec 1, the distance by both.
    const double maxError = static_cast<double>(layout.maxError);
    for (std::size_t i = 0; i < positions.size(); i += 3) {
      double squared = 0;
      bool isNear = true;  // farther out the promise is another one
      for (std::size_t c = i; c < i + 3; ++c) {
        isNear = isNear && std::fabs(positions[c]) <= 32;
        const double error =
            static_cast<double>(positions[c]) - static_cast<double>(decoder_->positions()[c]);
        squared += error * error;
        if (layout.codec == codec::kCodecLatticeZstd && std::fabs(positions[c]) <= 32) {
          ASSERT_LE(std::fabs(error), maxError) << "tick " << frame.tick;
        }
      }
      if (isNear) {
        ASSERT_LE(squared, 3 * maxError * maxError) << "tick " << frame.tick;
      }
    }
  }

  scene::Scene scene_;

 public:
  simulation::ClothSimulation simulation;
  codec::StreamLayout layout;
  encode::FrameEncoder encoder;

 private:
  vulkan::Recorder recorder_;
  vulkan::Buffer normals_;
  std::unique_ptr<codec::Encoder> reference_;
  std::unique_ptr<codec::Decoder> decoder_;
  std::vector<std::byte> packet_, expected_;
  double bytes_ = 0;
};

struct Sort {
  const char* name;
  std::uint8_t codec;
  scene::Normals normals;
  encode::Prediction prediction = encode::Prediction::onHost;
};

class FrameEncoder : public GpuTest, public testing::WithParamInterface<Sort> {};
INSTANTIATE_TEST_SUITE_P(
    Sorts, FrameEncoder,
    testing::Values(Sort{"lattice", codec::kCodecLatticeZstd, scene::Normals::none},
                    Sort{"latticeWithNormals", codec::kCodecLatticeZstd, scene::Normals::octahedral},
                    Sort{"hierarchical", codec::kCodecHierarchical, scene::Normals::none},
                    Sort{"hierarchicalOnDevice", codec::kCodecHierarchical, scene::Normals::none,
                         encode::Prediction::onDevice}),
    [](const auto& chosen) { return chosen.param.name; });

TEST_P(FrameEncoder, MakesThePacketsOfTheReferenceEncoder) {
  Encoding encoding(clothsOf(GetParam().normals), GetParam().codec, GetParam().prediction);
  for (std::uint64_t tick = 1; tick <= 120; ++tick) {
    const encode::RecordedFrame frame = encoding.tick(tick, tick % 40 == 0);
    EXPECT_EQ(frame.kind == codec::PacketKind::key, tick == 1 || tick % 40 == 0) << tick;
    if (testing::Test::HasFailure()) break;
  }
  // It moved: a still cloth would take some 20 bytes a frame.
  EXPECT_GT(encoding.kilobytes(), 120 * 0.1);
}

TEST_P(FrameEncoder, EqualsTheReferenceOnStatesOfAnySize) {
  Encoding encoding(clothsOf(GetParam().normals), GetParam().codec, GetParam().prediction);
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

TEST_P(FrameEncoder, KeepsTheErrorAtRoundingsEdges) {
  // Half way between lattice points, and the floats beside it: where a device that rounds otherwise would
  // differ.
  Encoding encoding(clothsOf(GetParam().normals), GetParam().codec, GetParam().prediction);
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

TEST_P(FrameEncoder, MakesThoseOfMeshesToo) {
  scene::Scene scene = clothsOf(GetParam().normals);
  scene.cloths.insert(scene.cloths.begin() + 1, discCloth(9));
  Encoding encoding(scene, GetParam().codec, GetParam().prediction);
  for (std::uint64_t tick = 1; tick <= 30 && !testing::Test::HasFailure(); ++tick)
    encoding.tick(tick, tick % 10 == 0);
}

TEST(StreamLayout, IsCodecTwosButWhereNormalsAreSent) {
  EXPECT_EQ(encode::streamLayout(clothsOf(scene::Normals::none), kEpoch).codec, codec::kCodecHierarchical);
  EXPECT_EQ(encode::streamLayout(clothsOf(scene::Normals::octahedral), kEpoch).codec,
            codec::kCodecLatticeZstd);
}

class FrameEncoderSlots : public GpuTest {};

TEST_F(FrameEncoderSlots, AreFreedByEntropyCodingOnAnotherThread) {
  const scene::Scene scene = clothsOf(scene::Normals::none);
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
  std::thread packer([&] {
    for (std::size_t i = 0; i < frames.size(); ++i) {
      packets[i].resize(encoding.encoder.packetBound());
      packets[i].resize(encoding.encoder.entropyCode(frames[i], packets[i]).bytes);
    }
  });
  packer.join();
  EXPECT_TRUE(encoding.encoder.canRecord());
  const auto decoder = codec::Decoder::make(encoding.layout);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(decoder->decode(packets[i]), codec::DecodeResult::ok) << i;
    EXPECT_EQ(decoder->tick(), frames[i].tick);
  }
}

TEST_F(FrameEncoderSlots, AFrameAfterForgettingIsAKeyFrame) {
  Encoding encoding(clothsOf(scene::Normals::none));
  EXPECT_EQ(encoding.tick(1, false).kind, codec::PacketKind::key);
  EXPECT_EQ(encoding.tick(2, false).kind, codec::PacketKind::predicted);
  encoding.encoder.forgetHistory();
  EXPECT_EQ(encoding.tick(3, false).kind, codec::PacketKind::key);
  EXPECT_EQ(encoding.tick(4, false).referenceTick, 3u);
}

}  // namespace
}  // namespace clothstream::tests
