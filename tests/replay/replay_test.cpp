// SPDX-License-Identifier: MIT
// Replays the recordings of this folder, one for each named scene: through the decoder, and those of this
// version through the simulation.
//
// Neither may differ at all. The decoder computes with integers. Kernels use only operations whose result
// Vulkan defines, in an order that depends on the scene alone (docs/architecture.md), so every device must
// reach the recorded hash.
//
// The frames show how far a differing state is off. No vertex of the original was farther from its frame than
// sqrt(3) max_error plus the rounding of a coordinate to float32.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "clothstream/v1/recording.pb.h"
#include "proto/codec/decoder.h"
#include "proto/recording/recording_reader.h"
#include "server/encode/frame_encoder.h"
#include "server/messages/scene_file.h"
#include "server/messages/scene_message.h"
#include "server/recording/resimulate.h"
#include "server/scene/live_scene.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/replay/recorded_scene.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::replay {
namespace {

using recording::Topic;

// Directory of the recordings that a version of this program made.
std::string recordingsOf(const std::string& version) {
  return "tests/replay/" + version;
}

// Recordings of all versions: "VERSION/SCENE", sorted.
std::vector<std::string> keptRecordings() {
  std::vector<std::string> kept;
  for (const auto& version : std::filesystem::directory_iterator("tests/replay")) {
    if (!version.is_directory()) continue;
    for (const auto& file : std::filesystem::directory_iterator(version))
      kept.push_back(version.path().filename().string() + "/" + file.path().stem().stem().string());
  }
  std::ranges::sort(kept);
  return kept;
}

// Decoded positions by tick. Every frame must decode to the state that its encoder held.
struct DecodedFrames {
  std::map<std::uint64_t, std::vector<float>> positions;
  float maxError = 0;
};

DecodedFrames decode(const std::string& path) {
  DecodedFrames decoded;
  auto reader = recording::RecordingReader::open(path);
  EXPECT_TRUE(reader) << reader.error();
  if (!reader) return decoded;
  std::unique_ptr<codec::Decoder> decoder;
  std::size_t frames = 0;
  for (auto message = reader->next();; message = reader->next()) {
    EXPECT_TRUE(message) << message.error();
    if (!message || !*message) break;
    const std::string_view bytes = (*message)->bytes;
    if ((*message)->topic == Topic::scene) {
      v1::RecordedScene recorded;
      EXPECT_TRUE(recorded.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
      const auto scene = messages::toScene(recorded.scene());
      EXPECT_TRUE(scene) << scene.error().text;
      if (!scene) return decoded;
      decoded.maxError = scene->stream.maxError;
      decoder = codec::Decoder::make(encode::streamLayout(*scene, scene::kEpoch));
    }
    if ((*message)->topic != Topic::frames) continue;
    v1::Frame frame;
    EXPECT_TRUE(decoder && frame.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
    if (!decoder) return decoded;
    const auto result = decoder->decode(std::as_bytes(std::span(frame.packet())));
    EXPECT_EQ(result, codec::DecodeResult::ok) << "frame " << frames;
    EXPECT_EQ(decoder->reconstructionHash(), frame.reconstruction_hash()) << "tick " << decoder->tick();
    const std::span<const float> positions = decoder->positions();
    decoded.positions[decoder->tick()].assign(positions.begin(), positions.end());
    ++frames;
  }
  EXPECT_GT(frames, 10u);
  return decoded;
}

// Largest distance of a vertex from its position in the frame, in metres.
double distance(const std::vector<float>& shown, const simulation::NodeState& state) {
  double largest = 0;
  for (std::size_t i = 0; i < state.positions.size(); ++i) {
    const model::Vec3 vertex(shown[3 * i], shown[3 * i + 1], shown[3 * i + 2]);
    const double away = (state.positions[i].cast<double>() - vertex.cast<double>()).norm();
    if (!(away <= largest)) largest = away;
  }
  return largest;
}

void replay(const std::string& path, std::uint32_t ticks) {
  const DecodedFrames frames = decode(path);
  if (::testing::Test::HasFailure()) return;
  // Half a unit in the last place of a coordinate within 4 m, along three axes.
  const double promise = std::sqrt(3.0) * (double{frames.maxError} + 4 * std::ldexp(1.0, -24));
  std::size_t compared = 0;
  const auto result =
      recording::resimulate({.path = path,
                             .device = [](std::uint32_t) { return vulkan::DeviceOptions{}; },
                             .interrupted = [] { return false; },
                             .progress = {},
                             .states =
                                 [&](const recording::SimulatedState& state) {
                                   const std::uint64_t tick = state.snapshot.tick;
                                   const auto frame = frames.positions.find(tick);
                                   if (frame == frames.positions.end()) {
                                     EXPECT_TRUE(state.same) << "tick " << tick << " is not what it was";
                                     return;
                                   }
                                   ASSERT_EQ(frame->second.size(), 3 * std::size_t{state.scene.nodeCount()});
                                   const double away =
                                       distance(frame->second, simulation::unpack(state.snapshot));
                                   EXPECT_TRUE(state.same) << fmt::format(
                                       "tick {} is not what it was: a node is {:.3g} m from where its frame "
                                       "shows it, of which {:.3g} m "
                                       "may be the codec's",
                                       tick, away, promise);
                                   EXPECT_LE(away, promise) << "tick " << tick;
                                   ++compared;
                                 }});
  ASSERT_TRUE(result) << result.error();
  EXPECT_EQ(result->ticks, ticks);
  EXPECT_EQ(result->different, 0u) << recording::toText(*result);
  EXPECT_GT(compared, 10u);
}

TEST(KeptRecordings, CoverAllScenesOfThisVersion) {
  for (const std::string& scene : keptScenes())
    EXPECT_TRUE(std::filesystem::exists(recordingsOf(CLOTHSTREAM_VERSION) + "/" + scene + ".mcap.gz"))
        << scene << " has no recording: docs/recording.md says how to write it";
}

class Replay : public tests::GpuTest, public ::testing::WithParamInterface<std::string> {};

// Motion changed in 0.3.0: older recordings have the same frames, and other states.
TEST_P(Replay, KeptRecordingHasTheSameFramesAndStates) {
  const std::string kept = recordingsOf(GetParam()) + ".mcap.gz";
  auto scene = messages::loadScene(std::filesystem::path(GetParam()).filename().string());
  ASSERT_TRUE(scene);
  EXPECT_LE(std::filesystem::file_size(kept), 150'000u);
  const e2e::TemporaryDirectory directory;
  const std::string path = (directory.path() / "recording.mcap").string();
  decompress(kept, path);
  if (GetParam().starts_with(CLOTHSTREAM_VERSION "/"))
    replay(path, ticksFor(*scene));
  else
    decode(path);
}

INSTANTIATE_TEST_SUITE_P(Versions, Replay, ::testing::ValuesIn(keptRecordings()), [](const auto& kept) {
  std::string name = kept.param;
  std::ranges::replace_if(
      name, [](char c) { return c == '.' || c == '/'; }, '_');
  return name;
});

class ReplayHere : public tests::GpuTest {};

TEST_F(ReplayHere, OlderRecordingIsNamedAsOneOfOtherKernels) {
  const e2e::TemporaryDirectory directory;
  const std::string path = (directory.path() / "recording.mcap").string();
  decompress(recordingsOf("0.2.0/flag.mcap.gz"), path);
  const auto result = recording::resimulate({.path = path,
                                             .device = [](std::uint32_t) { return vulkan::DeviceOptions{}; },
                                             .interrupted = [] { return false; },
                                             .progress = {},
                                             .states = {}});
  ASSERT_TRUE(result) << result.error();
  EXPECT_EQ(result->kernels, recording::Kernels::other);
  EXPECT_TRUE(result->missing.empty());
}

TEST_F(ReplayHere, NewRecordingHasTheSameFramesAndStates) {
  const e2e::TemporaryDirectory directory;
  const auto scene = messages::loadScene("folds");
  ASSERT_TRUE(scene);
  replay(recordScene(tests::device(), "folds", directory.path()), ticksFor(*scene));
}

}  // namespace
}  // namespace clothstream::replay
