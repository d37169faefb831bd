// SPDX-License-Identifier: MIT
// Codec 2's prediction on the device: whatever cloth does, the packets are those of the reference encoder.
#include <condition_variable>
#include <deque>
#include <mutex>
#include <random>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/codec/motion.h"
#include "tests/encode/encoding.h"

namespace clothstream::tests {
namespace {

class DevicePrediction : public GpuTest {};

// Encodes states that are given.
class Playing : public Encoding {
 public:
  explicit Playing(const model::Scene& scene) : Encoding(scene, encode::Prediction::onDevice) {}

  encode::RecordedFrame show(const std::vector<float>& positions, std::uint64_t tick, bool key = false) {
    return encodeState(stateOf(positions), tick, key);
  }

  static simulation::NodeState stateOf(const std::vector<float>& positions) {
    simulation::NodeState state;
    for (std::size_t i = 0; i < positions.size(); i += 3) {
      state.positions.emplace_back(positions[i], positions[i + 1], positions[i + 2]);
      state.velocities.emplace_back(0, 0, 0);
    }
    return state;
  }
};

model::Scene squareOf(std::uint32_t edge) {
  return sceneOf({calmCloth(edge, edge)});
}

TEST_F(DevicePrediction, EqualsTheReferenceIfWeightsFitOnlySomeChunks) {
  // The cloth is so large that each phase of the finest level needs its own dispatch and only some chunks are
  // fitted per frame.
  Playing playing(squareOf(100));
  for (std::uint64_t tick = 1; tick <= 24 && !HasFailure(); ++tick)
    playing.show(codec::sampleMotion(playing.layout, tick, 0.04f).positions, tick, tick == 16);
}

TEST_F(DevicePrediction, EqualsTheReferenceWhileVerticesRestAndMoveAgain) {
  Playing playing(squareOf(40));
  std::uint64_t moment = 1;
  for (std::uint64_t tick = 1; tick <= 60 && !HasFailure(); ++tick) {
    // All stand still from 20 to 29.
    if (tick < 20 || tick >= 30) ++moment;
    codec::MotionFrame frame = codec::sampleMotion(playing.layout, moment, 0.03f);
    // From 5 to 49 most of the cloth stands still, more than may start to rest in one frame.
    if (tick >= 5 && tick < 50) {
      const codec::MotionFrame still = codec::sampleMotion(playing.layout, 5, 0.03f);
      std::copy_n(still.positions.begin(), 3 * 1000, frame.positions.begin());
    }
    playing.show(frame.positions, tick, tick == 40);
  }
}

TEST_F(DevicePrediction, EqualsTheReferenceForEveryPlaceOfKeyFrames) {
  Playing playing(squareOf(24));
  const std::set<std::uint64_t> keys{1, 2, 3, 6, 10, 15, 21, 22, 40};
  for (std::uint64_t tick = 1; tick <= 50 && !HasFailure(); ++tick) {
    const bool forgets = tick == 30 || tick == 31;
    if (forgets) playing.encoder.forgetHistory();
    const encode::RecordedFrame frame =
        playing.show(codec::sampleMotion(playing.layout, tick, 0.02f).positions, tick, keys.contains(tick));
    EXPECT_EQ(frame.kind == codec::PacketKind::key, forgets || keys.contains(tick)) << tick;
  }
}

TEST_F(DevicePrediction, EqualsTheReferenceAtEveryMaxErrorAndWithWideResiduals) {
  for (const float maxError : {5e-6f, 1e-4f, 0.0005f, 0.01f, 1.0f}) {
    // The mesh has uneven weights of parents, whose sums need more than 32 bits here.
    model::Scene scene = sceneOf({calmCloth(16, 16), discCloth(12)});
    scene.stream.maxError = maxError;
    Playing playing(scene);
    std::mt19937 random(3);
    // At 0.5 mm more than 33 m are more than 16 bits.
    std::uniform_real_distribution<float> anywhere(-60, 60);
    for (std::uint64_t tick = 1; tick <= 16 && !HasFailure(); ++tick) {
      std::vector<float> positions = codec::sampleMotion(playing.layout, tick, 0.02f).positions;
      for (std::size_t i = tick % 5; i < positions.size(); i += 7 * tick) positions[i] = anywhere(random);
      playing.show(positions, tick);
    }
  }
}

TEST_F(DevicePrediction, EqualsTheReferenceHalfwayBetweenUnits) {
  model::Scene scene = squareOf(16);
  // A unit is 2^-18 m at this error (codec::hierarchical::latticeUnit()), so that positions are exactly
  // halfway between units.
  scene.stream.maxError = 261 * 0x1p-19f;
  Playing playing(scene);
  std::mt19937 random(4);
  std::uniform_int_distribution<int> halves(-400'000, 400'000), beyond(-3, 3);
  for (std::uint64_t tick = 1; tick <= 8 && !HasFailure(); ++tick) {
    std::vector<float> positions;
    for (std::uint32_t i = 0; i < 3 * playing.layout.vertexCount(); ++i) {
      const float x = static_cast<float>(halves(random)) * 0x1p-19f;
      positions.push_back(tick % 2 == 0 ? x : std::nextafter(x, static_cast<float>(beyond(random))));
    }
    playing.show(positions, tick);
  }
}

// Triangles that share no vertex: the first phase has one of each, more than a small phase.
model::Cloth confetti(std::uint32_t triangles) {
  model::MeshShape shape;
  for (std::uint32_t t = 0; t < triangles; ++t) {
    const auto x = 0.1f * static_cast<float>(t % 30), y = 0.1f * static_cast<float>(t / 30);
    shape.positions.insert(shape.positions.end(), {{x, y, 0}, {x + 0.05f, y, 0}, {x, y + 0.05f, 0}});
    shape.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
  }
  shape.submeshes = {{"", 0, triangles}};
  model::Cloth cloth = calmCloth(2, 2);
  cloth.mesh = std::make_shared<const model::Mesh>(model::makeMesh(std::move(shape)));
  cloth.mass = 0.02f * static_cast<float>(cloth.nodeCount());
  return cloth;
}

TEST_F(DevicePrediction, EqualsTheReferenceForEveryShapeOfCloth) {
  Playing playing(sceneOf({confetti(600), calmCloth(3, 2), discCloth(12), calmCloth(2, 31)}));
  for (std::uint64_t tick = 1; tick <= 12 && !HasFailure(); ++tick)
    playing.show(codec::sampleMotion(playing.layout, tick, 0.05f).positions, tick);
}

TEST_F(DevicePrediction, EqualsTheReferenceForEveryNumberOfWaitingFrames) {
  const model::Scene scene = squareOf(30);
  simulation::ClothSimulation simulation(device(), scene);
  const codec::StreamLayout layout = encode::streamLayout(scene, kEpoch);
  encode::FrameEncoder encoder(device(), simulation, layout, encode::Prediction::onDevice);
  const auto reference = codec::Encoder::make(layout, {.weightLag = encode::kWeightLag});
  vulkan::Recorder recorder(device());
  std::vector<std::byte> packet(encoder.packetBound()), expected(reference->packetBound());
  struct Waiting {
    encode::RecordedFrame frame;
    std::vector<float> positions;
  };
  std::deque<Waiting> waiting;
  std::mt19937 random(5);
  for (std::uint64_t tick = 1; tick <= 60; ++tick) {
    // None, one or all of them are coded before the next is recorded.
    std::size_t most = random() % (encode::FrameEncoder::kSlots);
    if (!encoder.canRecord()) most = std::min<std::size_t>(most, encode::FrameEncoder::kSlots - 1);
    for (; waiting.size() > most; waiting.pop_front()) {
      const auto& [frame, positions] = waiting.front();
      const encode::EncodedFrame encoded = encoder.entropyCode(frame, packet);
      const std::size_t bytes = reference->encode(frame.tick, frame.kind, positions, {}, expected);
      ASSERT_TRUE(
          std::ranges::equal(std::span(packet).first(encoded.bytes), std::span(expected).first(bytes)))
          << frame.tick;
      EXPECT_EQ(encoded.reconstructionHash, reference->reconstructionHash());
    }
    const std::vector<float> positions = codec::sampleMotion(layout, tick, 0.03f).positions;
    recorder.begin();
    simulation.recordRestoreState(recorder, simulation::pack(Playing::stateOf(positions), tick));
    waiting.push_back({encoder.record(recorder, tick, tick % 25 == 0), positions});
    submitAndWait(device(), recorder);
  }
}

TEST_F(DevicePrediction, EqualsTheReferenceIfAnotherThreadCodes) {
  const model::Scene scene = squareOf(20);
  simulation::ClothSimulation simulation(device(), scene);
  const codec::StreamLayout layout = encode::streamLayout(scene, kEpoch);
  encode::FrameEncoder encoder(device(), simulation, layout, encode::Prediction::onDevice);
  constexpr std::uint64_t kTicks = 80;
  // Complete recordings, in order.
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<encode::RecordedFrame> complete;
  std::size_t coded = 0;
  std::vector<std::vector<std::byte>> packets;
  std::thread coder([&] {
    for (std::uint64_t i = 0; i < kTicks; ++i) {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return !complete.empty(); });
      const encode::RecordedFrame frame = complete.front();
      complete.pop_front();
      lock.unlock();
      packets.emplace_back(encoder.packetBound());
      packets.back().resize(encoder.entropyCode(frame, packets.back()).bytes);
      lock.lock();
      ++coded;
      changed.notify_all();
    }
  });
  vulkan::Recorder recorder(device());
  for (std::uint64_t tick = 1; tick <= kTicks; ++tick) {
    {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return tick - 1 - coded < encode::FrameEncoder::kSlots; });
    }
    const std::vector<float> positions = codec::sampleMotion(layout, tick, 0.03f).positions;
    recorder.begin();
    simulation.recordRestoreState(recorder, simulation::pack(Playing::stateOf(positions), tick));
    const encode::RecordedFrame frame = encoder.record(recorder, tick, tick == 40);
    submitAndWait(device(), recorder);
    const std::lock_guard lock(mutex);
    complete.push_back(frame);
    changed.notify_all();
  }
  coder.join();
  const auto reference = codec::Encoder::make(layout, {.weightLag = encode::kWeightLag});
  std::vector<std::byte> expected(reference->packetBound());
  for (std::uint64_t tick = 1; tick <= kTicks; ++tick) {
    const std::vector<float> positions = codec::sampleMotion(layout, tick, 0.03f).positions;
    const auto kind = tick == 40 ? codec::PacketKind::key : codec::PacketKind::predicted;
    const std::size_t bytes = reference->encode(tick, kind, positions, {}, expected);
    ASSERT_TRUE(std::ranges::equal(packets[tick - 1], std::span(expected).first(bytes))) << tick;
  }
}

}  // namespace
}  // namespace clothstream::tests
