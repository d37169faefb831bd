// SPDX-License-Identifier: MIT
// Scenes that continue from their serialised checkpoints have the states of scenes that were never
// interrupted.
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/scene_file.h"
#include "server/messages/scene_message.h"
#include "server/saved_state/state_message.h"
#include "server/scene/resume_token.h"
#include "tests/messages/scenes.h"
#include "tests/serving/scene/busy_scene.h"

namespace clothstream::saved_state {
namespace {

using model::SolverKind;
using tests::HostedScene;

// Keeps the checkpoint of one tick, or of the end of the server at that tick.
class TickKeeper final : public scene::SceneKeeper {
 public:
  explicit TickKeeper(std::uint64_t tick) : tick_(tick) {}
  bool due(schedule::Clock::time_point) override { return begun_++ == tick_ - 1; }
  void save(scene::Checkpoint checkpoint) override {
    if (checkpoint.state.tick == tick_) kept = std::move(checkpoint);
  }
  std::optional<schedule::Clock::time_point> savedAt() const override { return {}; }
  std::optional<schedule::Clock::time_point> unsavedSince() const override { return {}; }

  std::optional<scene::Checkpoint> kept;

 private:
  const std::uint64_t tick_;
  std::uint64_t begun_ = 0;
};

scene::Checkpoint throughBytes(const scene::Checkpoint& checkpoint, const model::Scene& start) {
  v1::SavedCheckpoint message;
  EXPECT_TRUE(message.ParseFromString(toMessage(checkpoint).SerializeAsString()));
  auto read = toCheckpoint(message, start);
  EXPECT_TRUE(read.has_value()) << read.error();
  return read ? std::move(*read) : scene::Checkpoint{};
}

// The scene with this checkpoint, and with participant 7, who moves everything in busyTick().
scene::SavedScene savedScene(const model::Scene& start, const scene::Checkpoint& checkpoint) {
  scene::SavedScene saved{.start = start};
  saved.checkpoint = throughBytes(checkpoint, start);
  scene::SavedParticipant& mover = saved.roster.participants.emplace_back();
  mover.participant.id = 7;
  mover.tokenHash = scene::hashOfToken(std::string(scene::kTokenBytes, 'x'));
  return saved;
}

void restore(scene::LiveScene& live, scene::SavedScene saved) {
  live.restore(std::move(saved), {}, schedule::Clock::now());
}

// A journal that fails when it begins.
class FailingJournal final : public scene::Journal {
 public:
  bool active() const override { return false; }
  bool due() const override { return true; }
  void begin(const vulkan::DeviceInfo&, const model::Scene&, const v1::StreamDescription&,
             const simulation::StateSnapshot&, const simulation::StateSnapshot&) override {
    if (fails) throw vulkan::DeviceLost("the test loses the device");
  }
  void ticked(const scene::AppliedTick&) override {}
  void saved(const simulation::StateSnapshot&) override {}
  void restored(std::uint64_t, const simulation::StateSnapshot&) override {}
  void end() override {}
  void sent(const delivery::SharedBytes&) override {}
  void joined(std::uint64_t, const std::string&, const std::string&) override {}
  void left(std::uint64_t) override {}

  bool fails = true;
};

// A sheet on a tetrahedron, whose file gave it joints and limits that no definition without meshes has.
v1::Scene clothes() {
  v1::Scene scene;
  scene.set_name("clothes");
  v1::Cloth& cloth = *scene.add_cloths();
  cloth.set_name("sheet");
  for (const float number : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 1.f, 1.f, 0.f, 0.f, 1.f, 0.f})
    cloth.mutable_mesh()->add_positions(number);
  for (const std::uint32_t vertex : {0u, 1u, 2u, 0u, 2u, 3u}) cloth.mutable_mesh()->add_triangles(vertex);
  cloth.mutable_skin()->set_collider("body");
  for (const float number : {0.5f, -1.0f, 0.25f, 0.0f}) cloth.mutable_skin()->add_max_distances(number);
  *scene.add_colliders() = messages::jointedTetrahedron("body", 1);
  return scene;
}

TEST(SavedParameters, KeepWhatJointsTheClothsFollow) {
  const messages::Result<model::Scene> start = messages::toScene(clothes());
  ASSERT_TRUE(start) << start.error().text;
  v1::Scene parameters = messages::toMessageWithoutMeshes(*start);
  parameters.mutable_cloths(0)->set_thickness(0.25f);
  const auto changed = withParameters(parameters, *start);
  ASSERT_TRUE(changed) << changed.error();
  EXPECT_EQ(changed->cloths[0].thickness, 0.25f);
  EXPECT_EQ(changed->cloths[0].skin, start->cloths[0].skin) << "the same, not a copy";
}

class CheckpointTest : public tests::GpuTest {};
class EverySolver : public CheckpointTest, public ::testing::WithParamInterface<SolverKind> {};

// The checkpoint of tick 30 is taken while two grabs hold, one of them draws its place to itself, and a
// change of solver is eased.
TEST_P(EverySolver, ContinuesFromACheckpointToTheBit) {
  const model::Scene scene = tests::busyScene(GetParam());
  const auto tick = [](HostedScene& hosted) { tests::busyTick(hosted, 25, 22); };
  const auto keeper = std::make_shared<TickKeeper>(30);
  HostedScene whole(scene, 1, [&](scene::LiveScene& live) { live.keeper = keeper; });
  for (int number = 1; number <= 60; ++number) tick(whole);
  ASSERT_TRUE(keeper->kept.has_value());
  EXPECT_FALSE(keeper->kept->state.held.nodes.empty());
  EXPECT_EQ(keeper->kept->grabs.slots.size(), 2u);
  EXPECT_EQ(keeper->kept->winds.size(), 1u);

  HostedScene restored(scene, 1,
                       [&](scene::LiveScene& live) { restore(live, savedScene(scene, *keeper->kept)); });
  EXPECT_EQ(restored.host.tick(), 30u);
  for (int number = 31; number <= 60; ++number) tick(restored);
  const std::vector<std::uint64_t> all = whole.stateHashes();
  ASSERT_EQ(all.size(), 60u);
  EXPECT_EQ(restored.stateHashes(), std::vector(all.begin() + 30, all.end()));
  EXPECT_EQ(restored.decoder->tick(), 60u);
  EXPECT_TRUE(restored.keys.front());
}

INSTANTIATE_TEST_SUITE_P(Checkpoint, EverySolver,
                         ::testing::Values(SolverKind::massSpring, SolverKind::constraint, SolverKind::acad,
                                           SolverKind::xpbd, SolverKind::implicitEuler));

// Meshes, hulls, attachments with a motion, self-collision.
TEST_F(CheckpointTest, NamedScenesContinueToTheBit) {
  for (const char* name : {"swing", "obstacles", "folds", "figure_15"}) {
    auto loaded = messages::loadScene(name);
    ASSERT_TRUE(loaded.has_value());
    // The definition itself goes through its message, as in the database.
    const auto scene = toScene(messages::toMessage(*loaded));
    ASSERT_TRUE(scene.has_value()) << scene.error();
    const auto keeper = std::make_shared<TickKeeper>(6);
    HostedScene whole(*loaded, 0, [&](scene::LiveScene& live) { live.keeper = keeper; });
    std::vector<std::uint64_t> expected, states;
    const auto run = [](HostedScene& hosted, std::vector<std::uint64_t>& hashes) {
      hosted.host.begin(hosted.now);
      hosted.host.finish();
      hashes.push_back(hosted.host.status().stateHash);
    };
    for (int number = 1; number <= 12; ++number) run(whole, expected);
    ASSERT_TRUE(keeper->kept.has_value()) << name;
    HostedScene restored(*scene, 0,
                         [&](scene::LiveScene& live) { restore(live, savedScene(*scene, *keeper->kept)); });
    for (int number = 7; number <= 12; ++number) run(restored, states);
    EXPECT_EQ(states, std::vector(expected.begin() + 6, expected.end())) << name;
  }
}

// The busy scene after this many ticks, with a grab that holds from tick 1 on.
scene::Checkpoint checkpointAfter(std::uint64_t ticks) {
  const auto keeper = std::make_shared<TickKeeper>(ticks);
  HostedScene whole(tests::busyScene(SolverKind::massSpring), 1,
                    [&](scene::LiveScene& live) { live.keeper = keeper; });
  for (std::uint64_t number = 1; number <= ticks; ++number) tests::busyTick(whole);
  EXPECT_TRUE(keeper->kept.has_value());
  return keeper->kept.value_or(scene::Checkpoint{});
}

// Each server ends before the scene has a tick.
TEST_F(CheckpointTest, SurvivesRestartsWithoutATickInBetween) {
  const model::Scene scene = tests::busyScene(SolverKind::massSpring);
  const scene::Checkpoint first = checkpointAfter(5);
  ASSERT_FALSE(first.state.held.nodes.empty());
  scene::Checkpoint newest = first;
  for (int start = 1; start <= 2; ++start) {
    const auto keeper = std::make_shared<TickKeeper>(5);
    HostedScene restored(scene, 1, [&](scene::LiveScene& live) {
      restore(live, savedScene(scene, newest));
      live.keeper = keeper;
    });
    restored.host.saveLast();
    ASSERT_TRUE(keeper->kept.has_value());
    newest = *keeper->kept;
  }
  EXPECT_EQ(newest.state.bytes, first.state.bytes);
  EXPECT_EQ(newest.state.held.nodes, first.state.held.nodes);
}

TEST_F(CheckpointTest, KeepsGrabsOfAHostThatWasRebuiltAndHasNotTicked) {
  const model::Scene scene = tests::busyScene(SolverKind::massSpring);
  const auto periodic = std::make_shared<TickKeeper>(5);
  HostedScene hosted(scene, 1, [&](scene::LiveScene& live) { live.keeper = periodic; });
  for (int number = 1; number <= 8; ++number) tests::busyTick(hosted);
  hosted.host.release();
  hosted.host.rebuild(
      std::make_unique<scene::SceneOnDevice>(tests::device(), scene, hosted.publisher.workers()), "test");
  const auto last = std::make_shared<TickKeeper>(8);
  hosted.live.keeper = last;
  hosted.host.saveLast();
  ASSERT_TRUE(last->kept.has_value());
  EXPECT_EQ(last->kept->grabs.slots.size(), 1u);
  EXPECT_EQ(throughBytes(*last->kept, scene).state.held.nodes, periodic->kept->state.held.nodes);
}

TEST_F(CheckpointTest, DropsWhatParticipantsHeldWhoAreNotInTheRoster) {
  const model::Scene scene = tests::busyScene(SolverKind::massSpring);
  const scene::Checkpoint with = checkpointAfter(5);
  ASSERT_EQ(with.colliders.colliders.size(), 1u);
  ASSERT_EQ(with.winds.size(), 1u);
  const auto keeper = std::make_shared<TickKeeper>(5);
  HostedScene restored(scene, 1, [&](scene::LiveScene& live) {
    scene::SavedScene saved = savedScene(scene, with);
    saved.roster.participants.front().participant.id = 8;
    restore(live, std::move(saved));
    live.keeper = keeper;
  });
  restored.host.saveLast();
  ASSERT_TRUE(keeper->kept.has_value());
  EXPECT_TRUE(keeper->kept->colliders.colliders.empty());
  EXPECT_TRUE(keeper->kept->winds.empty());
  EXPECT_TRUE(keeper->kept->state.held.nodes.empty());
  const scene::Checkpoint without = throughBytes(*keeper->kept, scene);
  for (const auto& slot : without.grabs.slots)
    EXPECT_EQ(slot.phase, scene::GrabsAndAttachments::Slot::Phase::empty);
  restored.tick();
  EXPECT_TRUE(restored.host.status().healthy);
}

// A tick that is repeated after a restart does the same work as before.
TEST_F(CheckpointTest, ContinuesWithTheWorkOfAnOverload) {
  const model::Scene scene = tests::busyScene(SolverKind::massSpring);
  const auto keeper = std::make_shared<TickKeeper>(6);
  HostedScene whole(scene, 1, [&](scene::LiveScene& live) { live.keeper = keeper; });
  const auto run = [](HostedScene& hosted, int ticks) {
    std::vector<std::uint64_t> hashes;
    for (int i = 0; i < ticks; ++i) {
      tests::busyTick(hosted);
      hashes.push_back(hosted.host.status().stateHash);
    }
    return hashes;
  };
  run(whole, 3);
  whole.host.setWork({2, 9});
  run(whole, 3);
  ASSERT_TRUE(keeper->kept.has_value());
  ASSERT_EQ(keeper->kept->work, (schedule::WorkLevel{2, 9}));
  HostedScene restored(scene, 1,
                       [&](scene::LiveScene& live) { restore(live, savedScene(scene, *keeper->kept)); });
  EXPECT_EQ(restored.host.work(), (schedule::WorkLevel{2, 9}));
  EXPECT_EQ(run(restored, 6), run(whole, 6));
}

TEST_F(CheckpointTest, KeepsHowCollidersYield) {
  const model::Scene scene = tests::busyScene(SolverKind::massSpring);
  scene::Checkpoint checkpoint = checkpointAfter(5);
  ASSERT_EQ(checkpoint.colliders.colliders.size(), 1u);
  auto& yield = checkpoint.colliders.colliders[0].yield.emplace();
  yield.accepted.position = {1, 2, 3};
  yield.depth = 0.006f;
  yield.step = 0.25f;
  yield.refused = yield.stands = true;
  const scene::Checkpoint read = throughBytes(checkpoint, scene);
  const auto& kept = read.colliders.colliders.at(0).yield;
  ASSERT_TRUE(kept.has_value());
  EXPECT_EQ(kept->accepted.position, yield.accepted.position);
  EXPECT_EQ(kept->depth, yield.depth);
  EXPECT_EQ(kept->step, yield.step);
  EXPECT_TRUE(kept->refused);
  EXPECT_TRUE(kept->stands);
}

TEST_F(CheckpointTest, HasTheEventsThatWereAnnounced) {
  const scene::Checkpoint checkpoint = checkpointAfter(1);
  ASSERT_EQ(checkpoint.grabs.slots.size(), 1u);
  EXPECT_GT(checkpoint.grabs.slots[0].vertices.value_or(0), 0u);
}

TEST_F(CheckpointTest, StaysUntilAHostContinuesFromIt) {
  const model::Scene scene = tests::busyScene(SolverKind::massSpring);
  const auto journal = std::make_shared<FailingJournal>();
  scene::LiveScene live(scene, {}, journal);
  restore(live, savedScene(scene, checkpointAfter(5)));
  delivery::FramePublisher publisher;
  EXPECT_THROW(scene::SceneHost(tests::device(), live, publisher), vulkan::DeviceLost);
  journal->fails = false;
  const scene::SceneHost host(tests::device(), live, publisher);
  EXPECT_EQ(host.tick(), 5u);
  EXPECT_EQ(live.restored(), nullptr);
}

TEST_F(CheckpointTest, RefusesWhatDoesNotFitTheScene) {
  const model::Scene scene = tests::busyScene(SolverKind::massSpring);
  const auto keeper = std::make_shared<TickKeeper>(20);
  HostedScene whole(scene, 1, [&](scene::LiveScene& live) { live.keeper = keeper; });
  for (int number = 1; number <= 20; ++number) tests::busyTick(whole, 5);
  ASSERT_TRUE(keeper->kept.has_value());
  const v1::SavedCheckpoint good = toMessage(*keeper->kept);
  ASSERT_TRUE(toCheckpoint(good, scene).has_value());
  const auto refuses = [&](const char* what, const auto& spoil) {
    v1::SavedCheckpoint message = good;
    spoil(message);
    EXPECT_FALSE(toCheckpoint(message, scene).has_value()) << what;
  };
  refuses("size", [](v1::SavedCheckpoint& m) { m.mutable_state()->mutable_state()->pop_back(); });
  refuses("number", [](v1::SavedCheckpoint& m) {
    m.mutable_state()->mutable_state()->replace(0, 4, std::string("\x00\x00\xc0\x7f", 4));
  });
  refuses("held node", [](v1::SavedCheckpoint& m) { m.mutable_state()->mutable_held()->set_nodes(0, 120); });
  refuses("held grab", [](v1::SavedCheckpoint& m) { m.mutable_state()->mutable_held()->set_grabs(0, 2); });
  refuses("places",
          [](v1::SavedCheckpoint& m) { m.mutable_state()->mutable_held()->mutable_places()->pop_back(); });
  refuses("grab", [](v1::SavedCheckpoint& m) { m.mutable_grabs()->RemoveLast(); });
  refuses("more grabs", [](v1::SavedCheckpoint& m) { *m.add_grabs() = m.grabs(0); });
  refuses("place", [](v1::SavedCheckpoint& m) { m.mutable_grabs(0)->mutable_place()->set_triangle(5000); });
  refuses("offsets", [](v1::SavedCheckpoint& m) { m.mutable_state()->mutable_held()->set_offsets("short"); });
  refuses("attachment", [](v1::SavedCheckpoint& m) { m.mutable_attachments(0)->set_attachment(1); });
  refuses("frames", [](v1::SavedCheckpoint& m) { *m.add_frames() = m.frames(0); });
  refuses("frame", [](v1::SavedCheckpoint& m) { m.mutable_frames(0)->mutable_position()->set_x(INFINITY); });
  refuses("pose", [](v1::SavedCheckpoint& m) { m.mutable_scene_colliders(0)->Clear(); });
  refuses("colliders", [](v1::SavedCheckpoint& m) { m.mutable_scene_colliders()->RemoveLast(); });
  refuses("shape", [](v1::SavedCheckpoint& m) { m.mutable_colliders(0)->clear_shape(); });
  refuses("yield", [](v1::SavedCheckpoint& m) { m.mutable_colliders(0)->mutable_yield()->set_step(0); });
  refuses("wind", [](v1::SavedCheckpoint& m) { m.mutable_winds(0)->mutable_wind()->set_speed(101); });
  refuses("cloths", [](v1::SavedCheckpoint& m) { m.clear_cloths(); });
  refuses("substeps", [](v1::SavedCheckpoint& m) { m.set_substeps(13); });
  refuses("parameters", [](v1::SavedCheckpoint& m) { m.mutable_parameters()->clear_cloths(); });
  refuses("rows", [](v1::SavedCheckpoint& m) {
    m.mutable_parameters()->mutable_cloths(0)->mutable_grid()->set_rows(13);
  });
}

}  // namespace
}  // namespace clothstream::saved_state
