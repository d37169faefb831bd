// SPDX-License-Identifier: MIT
// A simulation whose frames are encoded by FrameEncoder and by the reference encoder, and compared.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "server/encode/frame_encoder.h"
#include "shaders/shared/types.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {

inline constexpr std::uint32_t kEpoch = 3;

// Three cloths of odd sizes that hang by their top rows or fall.
inline model::Scene clothsOf(model::Normals normals) {
  model::Cloth hanging = calmCloth(17, 23), strip = calmCloth(2, 5), falling = calmCloth(9, 8);
  hanging.name = "hanging";
  strip.name = "strip";
  falling.name = "falling";
  strip.grid.pose.position = {1, 0, 0};
  falling.grid.pose.position = {0, 1, 0.3f};
  hanging.pins = {topRow(hanging)};
  model::Scene scene = sceneOf({hanging, strip, falling});
  scene.stream.normals = normals;
  return scene;
}

inline std::vector<simulation::MovingCollider> sphereAt(std::uint64_t tick) {
  const auto z = [](std::uint64_t t) { return -0.5f + 0.01f * static_cast<float>(t); };
  simulation::MovingCollider sphere;
  sphere.shape = model::Sphere{0.08f};
  sphere.start.position = {0, -0.15f, z(tick)};
  sphere.end.position = {0, -0.15f, z(tick + 1)};
  return {sphere};
}

// A simulation whose frames are encoded on the device and on the CPU.
class Encoding {
 public:
  explicit Encoding(const model::Scene& scene, encode::Prediction prediction = encode::Prediction::automatic)
      : scene_(scene),
        simulation(device(), scene),
        layout(encode::streamLayout(scene, kEpoch)),
        encoder(device(), simulation, layout, prediction),
        recorder_(device()),
        normals_(device(), vulkan::BufferPurpose::readback, simulation.normals().bytes()),
        reference_(
            codec::Encoder::make(layout, {.weightLag = isOnDevice(prediction) ? encode::kWeightLag : 0})),
        decoder_(codec::Decoder::make(layout)),
        packet_(encoder.packetBound()),
        expected_(reference_->packetBound()) {}

  // Advances, encodes both ways, decodes, and compares.
  encode::RecordedFrame tick(std::uint64_t tick, bool forceKey, const simulation::TickInputs& inputs) {
    recorder_.begin();
    simulation.recordTick(recorder_, inputs);
    return encodeAndCompare(tick, forceKey);
  }
  encode::RecordedFrame tick(std::uint64_t tick, bool forceKey) {
    return this->tick(tick, forceKey, inputsOf(scene_, sphereAt(tick)));
  }

  encode::RecordedFrame encodeState(const simulation::NodeState& state, std::uint64_t tick, bool forceKey) {
    recorder_.begin();
    simulation.recordRestoreState(recorder_, simulation::pack(state, tick));
    return encodeAndCompare(tick, forceKey);
  }

  double kilobytes() const { return bytes_ / 1000; }

 private:
  static bool isOnDevice(encode::Prediction prediction) {
    return prediction == encode::Prediction::onDevice ||
           (prediction == encode::Prediction::automatic && !device().isSoftware());
  }

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
    for (const model::Vec3& p :
         simulation::unpack(simulation.collectState(frame.tick), simulation.origin()).positions) {
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
    const double maxError = static_cast<double>(layout.maxError);
    for (std::size_t i = 0; i < positions.size(); i += 3) {
      double squared = 0;
      double farthest = 0;
      bool isNear = true;  // to the origin; farther out the promise is not tested
      for (std::size_t c = i; c < i + 3; ++c) {
        isNear = isNear && std::fabs(positions[c]) <= 32;
        const double inWorld = double{layout.origin[c - i]} + double{positions[c]};
        farthest = std::max(farthest, std::fabs(inWorld));
        const double error = inWorld - static_cast<double>(decoder_->positions()[c]);
        squared += error * error;
      }
      // FRAME_FORMAT.md: the rounding of floats, beyond 32 m.
      const double promised = maxError + (farthest > 32 ? 0x1p-23 * farthest - 0x1p-19 : 0);
      if (isNear) {
        ASSERT_LE(squared, 3 * promised * promised) << "tick " << frame.tick;
      }
    }
  }

  model::Scene scene_;

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

}  // namespace clothstream::tests
