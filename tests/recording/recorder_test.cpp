// SPDX-License-Identifier: MIT
// Scenes that are recorded while they run, and simulated again from the recording.
#include "server/recording/recorder.h"

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include "proto/codec/packet_header.h"
#include "proto/recording/file.h"
#include "proto/recording/recorded_description.h"
#include "proto/recording/recording_reader.h"
#include "server/messages/scene_file.h"
#include "server/recording/recordings.h"
#include "server/recording/resimulate.h"
#include "server/scene/scene_host.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/model/surfaces.h"
#include "tests/serving/small_scene.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::recording {
namespace {

using schedule::Clock;
using ::testing::HasSubstr;
using tests::gravity;
using tests::handAt;
using tests::smallScene;
using tests::wind;

// A recorded scene on the shared device.
class RecordedScene {
 public:
  explicit RecordedScene(RecorderOptions options, model::Scene scene = smallScene())
      : recorder(std::make_shared<Recorder>(std::move(options))),
        live(std::move(scene), {}, recorder),
        host(std::make_unique<scene::SceneHost>(tests::device(), live, publisher)) {}
  ~RecordedScene() { publisher.drain(); }

  void ticks(int count) {
    for (int i = 0; i < count; ++i) {
      now += std::chrono::seconds(1);
      host->begin(now);
      host->finish();
      publisher.drain();
      hashes.push_back(host->status().stateHash);
    }
  }
  void change(model::ParameterChange change) {
    ASSERT_TRUE(live.inbox.postChange({.participant = 5, .change = std::move(change)}));
  }
  // Ends the recording and returns its path.
  std::string finish() {
    publisher.drain();
    host.reset();
    const std::string path = recorder->path();
    while (recorder->state() == Recorder::State::running) std::this_thread::yield();
    return path;
  }

  std::shared_ptr<Recorder> recorder;
  scene::LiveScene live;
  delivery::FramePublisher publisher;
  std::unique_ptr<scene::SceneHost> host;
  Clock::time_point now = Clock::now();
  std::vector<std::uint64_t> hashes;
};

class RecorderTest : public tests::GpuTest {
 protected:
  RecorderOptions options() const { return {.directory = directory_.path(), .serverName = "test"}; }
  Resimulation again(const std::string& path) const {
    auto result = resimulate({.path = path,
                              .device = [](std::uint32_t) { return vulkan::DeviceOptions{}; },
                              .interrupted = [] { return false; },
                              .progress = {}});
    EXPECT_TRUE(result.has_value()) << result.error();
    return result ? *result : Resimulation{};
  }

  e2e::TemporaryDirectory directory_;
};

// Applies every kind of input to a scene.
void happen(RecordedScene& recorded) {
  recorded.ticks(3);
  recorded.change(wind(3));
  recorded.ticks(7);
  const auto pose = [&](float z, int beyondTickMs) {
    const Clock::time_point trueAt =
        recorded.now + std::chrono::seconds(1) + std::chrono::milliseconds(beyondTickMs);
    recorded.live.inbox.postPoses(
        9,
        {.colliders = {handAt(1, 0.1f, -0.6f, z), handAt(4, -0.1f, -0.2f, z)},
         .grabs = {{.id = 1, .pose = {model::Vec3(0, -0.4f, z), model::Quaternion::Identity()}}}},
        recorded.now, {.trueAt = trueAt, .clientTimeUs = schedule::microseconds(trueAt)});
  };
  for (int i = 0; i < 12; ++i) {
    const float z = 0.02f * static_cast<float>(i) - 0.2f;
    pose(z - 0.01f, -33);
    pose(z, i < 6 ? 11 : -11);  // before: the tick lies between the two poses; after: it follows both
    recorded.ticks(1);
  }
  model::Solver constraint;
  constraint.kind = model::SolverKind::constraint;
  recorded.change({.cloths = {{.solver = constraint}}});
  recorded.ticks(30);  // longer than the correction fraction applies (0.5 s)
  recorded.live.inbox.postPoses(9, {}, recorded.now);
  model::ParameterChange heavier;
  heavier.cloths = {
      {.name = "sheet", .numbers = {{parameters::ClothNumber::damping, 0.7f}}, .arealMass = 0.3f}};
  heavier.colliders = {{.name = "ball", .position = model::Vec3(0.2f, -0.4f, 0.1f)}};
  recorded.change(heavier);
  recorded.ticks(40);
  recorded.live.resetRequested = true;
  recorded.ticks(50);
  recorded.change(gravity(-1e6f));
  recorded.ticks(1);  // the state becomes invalid
  recorded.change(gravity(-9.81f));
  recorded.ticks(20);  // continues from the last valid state
  recorded.change(gravity(-1e6f));
  recorded.ticks(2);  // invalid again: restarts from the start
  recorded.change(gravity(-5));
  recorded.ticks(60);
}

TEST_F(RecorderTest, ResimulatesEveryInputToTheBit) {
  RecordedScene recorded(options());
  happen(recorded);
  const std::size_t ticks = recorded.hashes.size();
  EXPECT_GT(recorded.live.metrics.rollbacks.value(), 0u);
  EXPECT_GT(recorded.live.metrics.resets.value(), 0u);
  const Resimulation result = again(recorded.finish());
  EXPECT_EQ(result.ticks, ticks);
  EXPECT_EQ(result.different, 0u) << toText(result);
  EXPECT_THAT(toText(result), HasSubstr("all bit-identical"));
}

TEST_F(RecorderTest, ContinuesAfterItsDeviceWasLost) {
  RecordedScene recorded(options());
  recorded.ticks(30);
  recorded.live.inbox.postPoses(
      9, {.grabs = {{.id = 1, .pose = {model::Vec3(0, -0.4f, 0), model::Quaternion::Identity()}}}},
      recorded.now);
  recorded.ticks(10);
  vulkan::Device another;
  recorded.host->release();
  recorded.host->rebuild(
      std::make_unique<scene::SceneOnDevice>(another, recorded.live.start(), recorded.publisher.workers()),
      "the device was lost");
  recorded.change(wind(2));
  recorded.ticks(30);
  const Resimulation result = again(recorded.finish());
  EXPECT_EQ(result.ticks, 70u);
  EXPECT_EQ(result.different, 0u) << toText(result);
}

TEST_F(RecorderTest, ResimulatesMeshesHullsAndAttachmentsToTheBit) {
  for (const char* name : {"swing", "obstacles", "tablecloth", "figure_15", "solver_xpbd", "balloon"}) {
    auto scene = messages::loadScene(name);
    ASSERT_TRUE(scene.has_value());
    RecordedScene recorded(options(), *scene);
    recorded.ticks(8);
    const Resimulation result = again(recorded.finish());
    EXPECT_EQ(result.ticks, 8u);
    EXPECT_EQ(result.different, 0u) << name << ": " << toText(result);
  }
}

// The file must not show the room of a participant, and must say that it leaves it out.
TEST_F(RecorderTest, LeavesSurfacesOfRealRoomsOutAndSaysSo) {
  RecordedScene recorded(options());
  scene::RoomSurfaces& surfaces = recorded.live.surfaces;
  surfaces.add(9, scene::Role::participant);
  recorded.ticks(5);
  model::Triangles floor = model::flat(0.4f, 0.4f, 3);
  for (model::Vec3& vertex : floor.vertices) vertex.y() = 12.345678f;
  ASSERT_TRUE(surfaces.put(*surfaces.begin(9, 1, {}, {}),
                           simulation::makeSurfaceTable(model::surfaceOf(floor)), false, 1));
  recorded.ticks(5);
  surfaces.remove(9, 1);
  recorded.ticks(5);
  const std::string path = recorded.finish();
  const Resimulation result = again(path);
  EXPECT_EQ(result.ticks, 5u);
  EXPECT_EQ(result.different, 0u);
  ASSERT_EQ(result.missing.size(), 1u);
  EXPECT_EQ(result.missing[0].after, 5u);
  EXPECT_THAT(result.missing[0].reason, HasSubstr("1 surfaces of a real room acted in tick 6"));
  EXPECT_EQ(result.verdict(), Verdict::missing);
  auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.has_value());
  const std::string height(reinterpret_cast<const char*>(&floor.vertices[0].y()), sizeof(float));
  for (auto message = reader->next(); *message; message = reader->next())
    EXPECT_EQ((*message)->bytes.find(height), std::string_view::npos);
}

TEST_F(RecorderTest, HoldsTheStreamAndRegularKeyFrames) {
  RecordedScene recorded(options());
  recorded.recorder->joined(3, "page", "Ada");
  recorded.ticks(250);
  recorded.recorder->left(3);
  auto reader = RecordingReader::open(recorded.finish());
  ASSERT_TRUE(reader.has_value()) << reader.error();
  EXPECT_TRUE(reader->check().has_value());
  EXPECT_EQ(reader->metadata("scene"), "small");
  EXPECT_EQ(reader->metadata("server"), "test");
  EXPECT_NE(reader->metadata("driver"), "unknown");
  EXPECT_EQ(readDescription(*reader)->scene(), "small");
  std::array<std::size_t, kTopicNames.size()> counts{};
  std::size_t sinceKey = 0, farthest = 0;
  for (auto message = reader->next(); *message; message = reader->next()) {
    ++counts[static_cast<std::size_t>((*message)->topic)];
    if ((*message)->topic != Topic::frames) continue;
    sinceKey = isKeyFrame((*message)->bytes) ? 0 : sinceKey + 1;
    farthest = std::max(farthest, sinceKey);
  }
  const auto count = [&](Topic topic) { return counts[static_cast<std::size_t>(topic)]; };
  EXPECT_EQ(count(Topic::frames), 250u);
  EXPECT_EQ(count(Topic::ticks), 250u);
  EXPECT_EQ(count(Topic::checkpoints), 2u);  // at the start, and after five seconds
  EXPECT_EQ(count(Topic::participants), 2u);
  EXPECT_EQ(count(Topic::reports), 25u);
  EXPECT_LT(farthest, kMaxKeyFrameDistance);
}

TEST_F(RecorderTest, FindsAndMeasuresADifferingTick) {
  RecordedScene recorded(options());
  recorded.ticks(210);
  auto reader = RecordingReader::open(recorded.finish());
  ASSERT_TRUE(reader.has_value());
  const std::string path = (directory_.path() / "changed.mcap").string();
  {
    auto file = OutputFile::create(path);
    auto writer = RecordingWriter::begin([&](std::string_view bytes) { return file->write(bytes); }, "test",
                                         reader->metadata());
    ASSERT_TRUE(writer.has_value());
    for (auto message = reader->next(); *message; message = reader->next()) {
      std::string bytes((*message)->bytes);
      v1::RecordedTick tick;
      if ((*message)->topic == Topic::ticks && tick.ParseFromString(bytes) && tick.tick() == 100) {
        tick.mutable_wind()->set_x(0.5f);
        bytes = tick.SerializeAsString();
      }
      ASSERT_TRUE(writer->write((*message)->topic, (*message)->time, bytes));
    }
    ASSERT_TRUE(writer->finish());
  }
  const Resimulation result = again(path);
  EXPECT_EQ(result.ticks, 210u);
  EXPECT_EQ(result.firstDifferent, 100u);
  EXPECT_EQ(result.different, 111u);
  ASSERT_EQ(result.differences.size(), 1u);  // state after five seconds
  EXPECT_EQ(result.differences[0].tick, 201u);
  EXPECT_GT(result.differences[0].largest, 1e-6);
  EXPECT_LT(result.differences[0].largest, 0.1);
  EXPECT_THAT(toText(result), HasSubstr("first tick 100"));
}

TEST_F(RecorderTest, ReportsFramesThatCannotBeDecoded) {
  RecordedScene recorded(options());
  recorded.ticks(20);
  std::ifstream file(recorded.finish(), std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const std::string path = (directory_.path() / "garbage.mcap").string();
  std::ofstream(path, std::ios::binary) << withGarbage(bytes);
  const Resimulation result = again(path);
  EXPECT_EQ(result.different, 0u);
  EXPECT_GT(result.faults.undecodable(), 5u);
  EXPECT_EQ(result.verdict(), Verdict::missing);
  EXPECT_THAT(toText(result), HasSubstr("cannot be decoded"));
  EXPECT_THAT(toJson(result), HasSubstr("\"undecodable\": "));
}

TEST_F(RecorderTest, RefusesBytesThatAreNoTickOfTheScene) {
  RecordedScene recorded(options());
  recorded.ticks(5);
  auto reader = RecordingReader::open(recorded.finish());
  ASSERT_TRUE(reader.has_value());
  const auto errorWith = [&](const char* name, const std::function<void(v1::RecordedTick&)>& change) {
    const std::string path = (directory_.path() / name).string();
    auto file = OutputFile::create(path);
    auto writer = RecordingWriter::begin([&](std::string_view bytes) { return file->write(bytes); }, "test",
                                         reader->metadata());
    reader->rewind();
    for (auto message = reader->next(); *message; message = reader->next()) {
      std::string bytes((*message)->bytes);
      v1::RecordedTick tick;
      if ((*message)->topic == Topic::ticks && tick.ParseFromString(bytes) && tick.tick() == 3) {
        change(tick);
        bytes = tick.SerializeAsString();
      }
      EXPECT_TRUE(writer->write((*message)->topic, (*message)->time, bytes));
    }
    EXPECT_TRUE(writer->finish());
    const auto result = resimulate({.path = path,
                                    .device = [](std::uint32_t) { return vulkan::DeviceOptions{}; },
                                    .interrupted = [] { return false; },
                                    .progress = {}});
    if (!result) return result.error();
    return result->missing.empty() ? std::string("none") : result->missing.front().reason;
  };
  EXPECT_THAT(errorWith("missing", [](v1::RecordedTick& tick) { tick.set_tick(4); }),
              HasSubstr("after tick 2 comes tick 4"));
  EXPECT_THAT(errorWith("far", [](v1::RecordedTick& tick) { tick.mutable_wind()->set_x(1e30f); }),
              HasSubstr("tick 3: one of its numbers is out of range"));
  EXPECT_THAT(errorWith("turned",
                        [](v1::RecordedTick& tick) {
                          tick.mutable_colliders(0)->mutable_start()->mutable_orientation()->set_w(3);
                        }),
              HasSubstr("tick 3: one of its numbers is out of range"));
  EXPECT_THAT(
      errorWith("shapeless", [](v1::RecordedTick& tick) { tick.mutable_colliders(0)->clear_shape(); }),
      HasSubstr("tick 3: one of its colliders has no shape"));
  EXPECT_THAT(errorWith("attached", [](v1::RecordedTick& tick) { tick.add_attachments(); }),
              HasSubstr("tick 3: its attachments are not those of the scene"));
  EXPECT_THAT(errorWith("carried",
                        [](v1::RecordedTick& tick) {
                          v1::AppliedCarry& carry = *tick.add_carries();
                          carry.set_cloth(1);
                          carry.mutable_from()->mutable_orientation()->set_w(1);
                          *carry.mutable_to() = carry.from();
                        }),
              HasSubstr("tick 3: one of its numbers is out of range"));
  EXPECT_THAT(errorWith("carried twice",
                        [](v1::RecordedTick& tick) {
                          tick.add_carries();
                          tick.add_carries();
                        }),
              HasSubstr("tick 3: it carries more cloths than the scene has"));
  EXPECT_THAT(errorWith("cloths",
                        [](v1::RecordedTick& tick) {
                          tick.add_cloths();
                          tick.add_cloths();
                        }),
              HasSubstr("tick 3: it has 2 cloths, but the scene has 1"));
}

TEST_F(RecorderTest, ContinuesFromTheNextStateAfterALostChunk) {
  RecordedScene recorded(options());
  recorded.ticks(100);
  // This change is in the part that will be lost. The next state does not show it.
  model::ParameterChange change;
  change.cloths.push_back({.numbers = {{parameters::ClothNumber::damping, 2.0f}}});
  recorded.change(change);
  recorded.ticks(150);
  auto reader = RecordingReader::open(recorded.finish());
  ASSERT_TRUE(reader.has_value());
  std::string bytes;
  {
    auto writer = RecordingWriter::begin(
        [&](std::string_view more) {
          bytes += more;
          return Written();
        },
        "test", reader->metadata());
    ASSERT_TRUE(writer.has_value());
    std::uint64_t ticks = 0;
    for (auto message = reader->next(); *message; message = reader->next()) {
      if ((*message)->topic == Topic::ticks) ++ticks;
      ASSERT_TRUE(writer->write((*message)->topic, ticks * 25'000'000, (*message)->bytes));
    }
    ASSERT_TRUE(writer->finish());
  }
  auto whole = McapReader::open(std::make_unique<MemorySource>(bytes));
  ASSERT_TRUE(whole.has_value());
  const ChunkPlace lost = whole->chunks()[whole->chunkAt(std::uint64_t{102} * 25'000'000)];
  bytes[lost.offset + lost.length / 2] ^= 4;
  const std::string path = (directory_.path() / "damaged.mcap").string();
  {
    auto file = OutputFile::create(path);
    ASSERT_TRUE(file && file->write(bytes));
  }
  const Resimulation result = again(path);
  ASSERT_EQ(result.missing.size(), 1u);
  EXPECT_EQ(result.missing[0].after, lost.start / 25'000'000 - 1);
  EXPECT_EQ(result.missing[0].until, 201u);
  EXPECT_THAT(result.missing[0].reason, HasSubstr("checksum does not match"));
  EXPECT_EQ(result.ticks, result.missing[0].after + 250 - 201);
  EXPECT_EQ(result.different, 0u);
  EXPECT_THAT(toText(result), HasSubstr("are missing until tick 201"));
}

// While it lives, no file of this program can grow beyond the limit.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

TEST_F(RecorderTest, FullDiskEndsTheRecordingButNotTheScene) {
  std::string path;
  std::vector<std::uint64_t> hashes;
  {
    RecordedScene recorded(options());
    {
      const FileSizeLimit limit(200'000);
      while (recorded.recorder->state() == Recorder::State::running) recorded.ticks(1);
    }
    EXPECT_EQ(recorded.recorder->state(), Recorder::State::failed);
    EXPECT_FALSE(recorded.recorder->active());
    recorded.ticks(10);
    hashes = recorded.hashes;
    path = recorded.recorder->path();
  }
  RecordedScene alone({.directory = directory_.path() / "none", .serverName = "test"});
  alone.ticks(static_cast<int>(hashes.size()));
  EXPECT_EQ(alone.recorder->state(), Recorder::State::failed);
  EXPECT_EQ(alone.hashes, hashes);

  auto reader = RecordingReader::open(path, CutFiles::read);
  ASSERT_TRUE(reader.has_value()) << reader.error();
  std::size_t frames = 0;
  for (auto message = reader->next(); message && *message; message = reader->next())
    if ((*message)->topic == Topic::frames) ++frames;
  EXPECT_GT(frames, 0u);
  EXPECT_LT(frames, hashes.size());
}

TEST_F(RecorderTest, RecordingsStayWithinTheirShareOfTheDisk) {
  constexpr std::uint64_t kMaxBytes = 300'000;
  RecorderOptions limited = options();
  limited.disk = std::make_shared<DiskShare>(directory_.path(), DiskLimits{.maxBytes = kMaxBytes});
  std::string path;
  {
    RecordedScene recorded(limited);
    while (recorded.recorder->state() == Recorder::State::running) recorded.ticks(1);
    EXPECT_EQ(recorded.recorder->state(), Recorder::State::failed);
    recorded.ticks(10);
    path = recorded.recorder->path();
  }
  // The file is complete. Checks happen a few times a second, and much may be written in between.
  auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.has_value()) << reader.error();
  EXPECT_TRUE(reader->check().has_value());
  EXPECT_GE(std::filesystem::file_size(path), kMaxBytes);
  const auto refused = Recorder::create(limited, "small", "");
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error(), HasSubstr("of 0.3 MB (--recordings-limit)"));
  std::filesystem::remove(path);
  std::this_thread::sleep_for(DiskShare::kInterval);
  EXPECT_TRUE(Recorder::create(limited, "small", "").has_value());
}

TEST_F(RecorderTest, EmptyFilesCountAndOtherFilesDoNot) {
  DiskShare share(directory_.path(), {.maxBytes = 8192});
  for (const char* name : {"a.txt", "b.mcap", "c.mcap"}) std::ofstream(directory_.path() / name) << "x";
  const auto room = share.check();
  ASSERT_FALSE(room.has_value());
  EXPECT_THAT(room.error(), HasSubstr("the recordings take"));
}

TEST_F(RecorderTest, LeavesSpaceOnTheDisk) {
  DiskShare share(directory_.path(), {.minFreeBytes = std::uint64_t{1} << 62});
  const auto room = share.check();
  ASSERT_FALSE(room.has_value());
  EXPECT_THAT(room.error(), HasSubstr("stay free (--keep-free)"));
}

TEST_F(RecorderTest, SlowDiskCompletesTheRecordingAndKeepsTheScene) {
  RecorderOptions small = options();
  small.maxWaitingBytes = 20'000;
  RecordedScene recorded(small);
  // Too many states for any disk.
  for (int i = 0; i < 200; ++i) recorded.recorder->saved({1, std::vector<std::byte>(10'000)});
  recorded.ticks(20);
  const std::string path = recorded.finish();
  EXPECT_EQ(recorded.recorder->state(), Recorder::State::failed);
  EXPECT_EQ(recorded.hashes.size(), 20u);
  auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.has_value()) << reader.error();
  EXPECT_TRUE(reader->check().has_value());
}

TEST_F(RecorderTest, NeverReusesTheNameOfARecording) {
  std::vector<std::string> paths;
  for (int i = 0; i < 3; ++i) {
    RecordedScene recorded(options());
    recorded.ticks(1);
    paths.push_back(recorded.finish());
  }
  std::ranges::sort(paths);
  EXPECT_EQ(std::ranges::unique(paths).size(), 0u);
}

TEST(Recordings, NeedAWritableDirectory) {
  const e2e::TemporaryDirectory directory;
  const Recordings made({.directory = directory.path() / "a" / "b", .serverName = "test"}, true);
  EXPECT_TRUE(std::filesystem::is_directory(directory.path() / "a" / "b"));
  EXPECT_THAT(made.report(), HasSubstr("running 0  complete 0  failed 0"));
  EXPECT_THROW(Recordings({.directory = "/proc/none", .serverName = "test"}, true), std::runtime_error);
}

}  // namespace
}  // namespace clothstream::recording
