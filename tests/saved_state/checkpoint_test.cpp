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
#include "tests/serving/scene/busy_scene.h"

namespace clothstream::saved_state {
namespace {

using model::SolverKind;
using tests::HostedScene;

// Keeps the checkpoint of one tick.
class TickKeeper final : public scene::SceneKeeper {
 public:
  explicit TickKeeper(std::uint64_t tick) : tick_(tick) {}
  bool due(schedule::Clock::time_point) override { return begun_++ == tick_ - 1; }
  void save(scene::Checkpoint checkpoint) override {
    if (checkpoint.state.tick == tick_) kept = std::move(checkpoint);
  }
  std::optional<schedule::Clock::time_point> savedAt() const override { return {}; }

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

class CheckpointTest : public tests::GpuTest {};
class EverySolver : public CheckpointTest, public ::testing::WithParamInterface<SolverKind> {};

// The checkpoint of tick 30 is taken while two grabs hold and a change of solver is eased.
TEST_P(EverySolver, ContinuesFromACheckpointToTheBit) {
  const model::Scene scene = tests::busyScene(GetParam());
  const auto tick = [](HostedScene& hosted) { tests::busyTick(hosted, 15, 22); };
  const auto keeper = std::make_shared<TickKeeper>(30);
  HostedScene whole(scene, 1, [&](scene::LiveScene& live) { live.keeper = keeper; });
  for (int number = 1; number <= 60; ++number) tick(whole);
  ASSERT_TRUE(keeper->kept.has_value());
  EXPECT_FALSE(keeper->kept->state.held.nodes.empty());
  EXPECT_EQ(keeper->kept->grabs.slots.size(), 2u);

  HostedScene restored(scene, 1, [&](scene::LiveScene& live) {
    scene::SavedScene saved{.start = scene};
    saved.checkpoint = throughBytes(*keeper->kept, scene);
    live.restore(std::move(saved), {}, schedule::Clock::now());
  });
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
    HostedScene restored(*scene, 0, [&](scene::LiveScene& live) {
      scene::SavedScene saved{.start = *scene};
      saved.checkpoint = throughBytes(*keeper->kept, *scene);
      live.restore(std::move(saved), {}, schedule::Clock::now());
    });
    for (int number = 7; number <= 12; ++number) run(restored, states);
    EXPECT_EQ(states, std::vector(expected.begin() + 6, expected.end())) << name;
  }
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
  refuses("held grab", [](v1::SavedCheckpoint& m) { m.mutable_state()->mutable_held()->set_grips(0, 2); });
  refuses("places",
          [](v1::SavedCheckpoint& m) { m.mutable_state()->mutable_held()->mutable_places()->pop_back(); });
  refuses("grab", [](v1::SavedCheckpoint& m) { m.mutable_grabs()->RemoveLast(); });
  refuses("more grabs", [](v1::SavedCheckpoint& m) { *m.add_grabs() = m.grabs(0); });
  refuses("attachment", [](v1::SavedCheckpoint& m) { m.mutable_attachments(0)->set_attachment(1); });
  refuses("pose", [](v1::SavedCheckpoint& m) { m.mutable_scene_colliders(0)->Clear(); });
  refuses("colliders", [](v1::SavedCheckpoint& m) { m.mutable_scene_colliders()->RemoveLast(); });
  refuses("shape", [](v1::SavedCheckpoint& m) { m.mutable_colliders(0)->clear_shape(); });
  refuses("cloths", [](v1::SavedCheckpoint& m) { m.clear_cloths(); });
  refuses("parameters", [](v1::SavedCheckpoint& m) { m.mutable_parameters()->clear_cloths(); });
  refuses("rows", [](v1::SavedCheckpoint& m) {
    m.mutable_parameters()->mutable_cloths(0)->mutable_grid()->set_rows(13);
  });
}

}  // namespace
}  // namespace clothstream::saved_state
