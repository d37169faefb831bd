// SPDX-License-Identifier: MIT
// Servers that end and start again with the same state directory.
#include "server/saved_state/saved_state.h"

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/saved_state.pb.h"
#include "server/messages/scene_message.h"
#include "server/model/price.h"
#include "server/scene/resume_token.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/model/meshes.h"
#include "tests/serving/server_test.h"
#include "tests/support/eventually.h"

// Starts the server, and ends the test if there is no device.
#define START(...)  \
  run(__VA_ARGS__); \
  if (IsSkipped()) return

namespace clothstream::saved_state {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using tests::eventually;
using tests::TestPeer;

class SavedStateTest : public tests::ServerTest {
 protected:
  // Starts a server on the directory. The former one must have ended.
  void run(hosting::ServerOptions options = {}, const scene::BudgetLimits& budget = kNoLimits,
           SavedStateOptions state = {}, const std::vector<model::Scene>& more = {}) {
    state.directory = directory_.path();
    state.checkpointInterval = 50ms;
    state.lookInterval = 20ms;
    store_ = std::make_shared<SavedState>(state);
    options.store = store_;
    start(std::move(options), more, budget);
  }
  void end() {
    stop();
    store_.reset();
  }
  void create(const model::Scene& scene) {
    v1::CreateSceneRequest request;
    *request.mutable_scene() = messages::toMessage(scene);
    std::promise<std::string> done;
    server().unaryCalls.createScene(
        request, [&](const auto& made) { done.set_value(made ? "" : made.error().text()); });
    ASSERT_EQ(done.get_future().get(), "");
  }
  void remove(const std::string& name) {
    v1::DeleteSceneRequest request;
    request.set_name(name);
    std::promise<std::string> done;
    server().unaryCalls.deleteScene(
        request, [&](const auto& made) { done.set_value(made ? "" : made.error().text()); });
    ASSERT_EQ(done.get_future().get(), "");
  }
  std::vector<std::string> names() {
    std::vector<std::string> names;
    const v1::ListScenesResponse list = server().unaryCalls.listScenes();
    for (const v1::SceneSummary& scene : list.scenes()) names.push_back(scene.name());
    return names;
  }
  std::shared_ptr<scene::LiveScene> live(const std::string& name) { return server().scenes.find(name); }
  static v1::Hello helloTo(const std::string& scene, const std::string& token) {
    v1::Hello hello;
    hello.set_scene(scene);
    hello.set_resume_token(token);
    return hello;
  }

  e2e::TemporaryDirectory directory_;
  std::shared_ptr<SavedState> store_;
};

TEST_F(SavedStateTest, CreatedScenesComeBackWithStateParametersAndParticipants) {
  START();
  create(tests::smallScene("mine"));
  std::string ada, ben;
  std::uint64_t adaId = 0, benId = 0, tick = 0;
  {
    TestPeer owner(server(), "owner"), other(server(), "other");
    owner.join("mine");
    other.join("mine");
    ada = owner.welcome().resume_token(), adaId = owner.welcome().participant_id();
    ben = other.welcome().resume_token(), benId = other.welcome().participant_id();
    ASSERT_TRUE(live("mine")->roster.wear(*live("mine")->subscribers.find(benId), "ball"));
    v1::ParameterChange change;
    change.mutable_gravity()->mutable_value()->set_y(-3);
    owner.change(change);
    owner.readUntil(v1::ServerMessage::kParameterChanged);
    owner.readFrames(20);
    tick = owner.frames().back().tick;
    server().stop();
  }
  end();
  run();
  EXPECT_THAT(names(), ::testing::Contains("mine"));
  EXPECT_GE(live("mine")->tick.load(), tick);
  EXPECT_EQ(live("mine")->definition().environment.gravity.y(), -3);
  EXPECT_TRUE(live("mine")->terms.created);
  EXPECT_EQ(live("mine")->roster.away(), 2u);
  TestPeer owner(server(), "owner"), other(server(), "other"), stranger(server(), "stranger");
  owner.hello(helloTo("mine", ada));
  owner.readFrames(2);
  EXPECT_TRUE(owner.welcome().resumed());
  EXPECT_EQ(owner.welcome().participant_id(), adaId);
  EXPECT_EQ(owner.welcome().role(), v1::ROLE_OWNER);
  EXPECT_EQ(owner.welcome().resume_token(), ada);
  EXPECT_GT(owner.frames().front().tick, tick);
  EXPECT_TRUE(owner.frames().front().key);
  other.hello(helloTo("mine", ben));
  other.readFrames(1);
  EXPECT_EQ(other.welcome().participant_id(), benId);
  EXPECT_EQ(other.welcome().role(), v1::ROLE_PARTICIPANT);
  EXPECT_EQ(other.welcome().participants(1).body(), "ball");
  std::string wrong = ada;
  wrong[0] = static_cast<char>(wrong[0] ^ 1);
  stranger.hello(helloTo("mine", wrong));
  stranger.readFrames(1);
  EXPECT_FALSE(stranger.welcome().resumed());
  EXPECT_GT(stranger.welcome().participant_id(), std::max(adaId, benId));
}

TEST_F(SavedStateTest, BansAndRemovedParticipantsStayOutAfterARestart) {
  START();
  const std::vector<scene::Ban> bans{{.subject = {.tenant = "studio", .name = "eve"}, .displayName = "Eve"}};
  std::string refused;
  {
    TestPeer owner(server(), "owner"), removed(server(), "removed");
    owner.join("small");
    removed.join("small");
    refused = removed.welcome().resume_token();
    v1::ClientMessage message;
    message.mutable_remove_participant()->set_participant_id(removed.welcome().participant_id());
    owner.send(message);
    EXPECT_EQ(removed.readToTheEnd().error().code(), v1::ERROR_CODE_REMOVED);
    live("small")->roster.setBans(bans);
    server().stop();
  }
  end();
  run();
  EXPECT_EQ(live("small")->roster.bans(), bans);
  EXPECT_TRUE(live("small")->roster.isBanned(bans[0].subject));
  EXPECT_FALSE(live("small")->roster.isBanned({.tenant = {}, .name = "eve"}));
  TestPeer again(server(), "removed");
  again.hello(helloTo("small", refused));
  EXPECT_EQ(again.readToTheEnd().error().code(), v1::ERROR_CODE_REMOVED);
}

TEST_F(SavedStateTest, ScenesOfTheServerGoOnUnlessTheirDefinitionChanged) {
  START();
  std::uint64_t tick = 0;
  {
    TestPeer peer(server());
    peer.join("small");
    peer.readFrames(10);
    tick = peer.frames().back().tick;
    server().stop();
  }
  end();
  run();
  EXPECT_GE(live("small")->tick.load(), tick);
  EXPECT_EQ(live("other")->tick.load(), 0u);
  end();
  store_ = std::make_shared<SavedState>(SavedStateOptions{.directory = directory_.path()});
  model::Scene changed = tests::smallScene("small");
  changed.cloths[0].mass *= 2;
  EXPECT_FALSE(store_->take(changed).has_value());
}

// Nothing of the directory names a token.
TEST_F(SavedStateTest, KeepsNoTokens) {
  START();
  create(tests::smallScene("mine"));
  std::string token;
  {
    TestPeer peer(server());
    peer.join("mine");
    token = peer.welcome().resume_token();
    server().stop();
  }
  end();
  Database database({.directory = directory_.path() / "scenes"});
  const auto contents = database.read("mine");
  ASSERT_TRUE(contents && contents->session);
  v1::SavedSession session;
  ASSERT_TRUE(session.ParseFromString(*contents->session));
  ASSERT_EQ(session.participants_size(), 1);
  EXPECT_EQ(session.participants(0).token_hash(), scene::hashOfToken(token));
  for (const auto& content : {contents->scene, contents->session, contents->checkpoint})
    EXPECT_EQ(content.value_or("").find(token), std::string::npos);
}

TEST_F(SavedStateTest, DeletedScenesStayDeleted) {
  START();
  create(tests::smallScene("mine"));
  {
    TestPeer peer(server());
    peer.join("mine");
    peer.readFrames(5);
    peer.leave();
  }
  create(tests::smallScene("asked"));
  remove("asked");
  end();
  // In the next run its lifetime ends.
  hosting::ServerOptions options;
  options.sceneLifetime = 100ms;
  run(options);
  ASSERT_TRUE(eventually([&] { return live("mine") == nullptr; }));
  ASSERT_TRUE(store_->flush(10s));
  end();
  run();
  EXPECT_THAT(names(), ::testing::ElementsAre("small", "other"));
}

// Parameters that were accepted but have not reached a tick come back too.
TEST_F(SavedStateTest, AScenePausedBeforeItsFirstTickKeepsChanges) {
  START();
  create(tests::smallScene("mine"));
  live("mine")->paused = true;
  v1::ParameterChange change;
  change.mutable_gravity()->mutable_value()->set_y(-3);
  ASSERT_TRUE(live("mine")->change(1, change, scene::Role::owner));
  ASSERT_TRUE(store_->flush(10s));
  end();
  run();
  EXPECT_TRUE(live("mine")->paused);
  EXPECT_EQ(live("mine")->definition().environment.gravity.y(), -3);
}

TEST_F(SavedStateTest, AnUnaffordableSceneIsKeptButDoesNotRun) {
  START();
  model::Scene large = tests::smallScene("large");
  large.cloths[0].solver.kind = model::SolverKind::constraint;
  large.cloths[0].solver.iterations = 10'000;
  large.cloths[0].solver.tolerance = 0.1f;
  create(large);
  create(tests::smallScene("tiny"));
  const double load =
      model::PriceModel(large).work(large).seconds(server().budget->speed()) * large.simulationRate;
  end();
  // Room for many small scenes. The speed of the device is measured again.
  scene::BudgetLimits little = kNoLimits;
  little.load = little.sceneLoad = load / 5;
  run({}, little);
  EXPECT_THAT(names(), ::testing::IsSupersetOf({"large", "tiny"}));
  TestPeer peer(server());
  peer.hello("large");
  const v1::ServerMessage last = peer.readToTheEnd();
  EXPECT_EQ(last.error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(last.error().text(),
              HasSubstr("is kept from before a restart, but does not run: it would take "));
  EXPECT_THAT(last.error().text(), HasSubstr("--max-load"));
  EXPECT_EQ(live("tiny")->quarantined(), "");
  create(tests::smallScene("later"));
  end();
  run();
  EXPECT_EQ(live("large")->quarantined(), "");
  TestPeer again(server());
  again.join("large");
  remove("large");
  end();
  run();
  EXPECT_THAT(names(), ::testing::Not(::testing::Contains("large")));
}

TEST_F(SavedStateTest, MoreScenesThanAllowedAreKeptButDoNotRun) {
  START();
  for (const char* name : {"one", "two"}) create(tests::smallScene(name));
  end();
  hosting::ServerOptions options;
  options.maxCreatedScenes = 1;
  run(options);
  EXPECT_EQ(live("one")->quarantined(), "");
  EXPECT_THAT(live("two")->quarantined(), HasSubstr("--max-created-scenes"));
}

// The scene with the first name is looked at before the one that is deleted.
TEST_F(SavedStateTest, ASceneThatWaitsForRoomOutlivesItsLifetime) {
  START();
  model::Scene large = tests::smallScene("a_large");
  large.cloths[0].grid.rows = large.cloths[0].grid.columns = 64;
  large.cloths[0].mass = 0.001f * static_cast<float>(large.cloths[0].nodeCount());
  create(large);
  create(tests::smallScene("unused"));
  end();
  scene::BudgetLimits little = kNoLimits;
  little.megabytes = little.sceneMegabytes = model::PriceModel(large).bytes(large) * 0.8 / 1e6;
  hosting::ServerOptions options;
  options.sceneLifetime = 100ms;
  run(options, little);
  ASSERT_NE(live("a_large")->quarantined(), "");
  ASSERT_TRUE(eventually([&] { return live("unused") == nullptr; }));
  EXPECT_NE(live("a_large"), nullptr);
  end();
  run();
  EXPECT_EQ(live("a_large")->quarantined(), "");
}

TEST_F(SavedStateTest, AServerSceneDoesNotReplaceACreatedOneOfTheSameName) {
  START();
  create(tests::smallScene("mine"));
  end();
  run({}, kNoLimits, {}, {tests::smallScene("mine")});
  EXPECT_FALSE(live("mine")->terms.created);
  EXPECT_EQ(live("mine")->keeper, nullptr);
  {
    TestPeer peer(server());
    peer.join("mine");
    peer.readFrames(5);
    server().stop();
  }
  end();
  run();
  ASSERT_NE(live("mine"), nullptr);
  EXPECT_TRUE(live("mine")->terms.created);
}

// The scene has never run, and the disk is too full for states.
TEST_F(SavedStateTest, BansAndRefusedTokensOfServerScenesSurvive) {
  START({}, kNoLimits, {.minFreeBytes = UINT64_MAX / 2});
  live("small")->paused = true;
  live("small")->roster.setBans({{.subject = {"acme", "eve"}, .displayName = "Eve"}});
  live("other")->paused = true;
  live("other")->roster.setBans({{.subject = {"acme", "eve"}, .displayName = "Eve"}});
  std::string token;
  {
    TestPeer owner(server(), "owner"), removed(server(), "removed");
    owner.join("other");
    removed.join("other");
    token = removed.welcome().resume_token();
    v1::ClientMessage message;
    message.mutable_remove_participant()->set_participant_id(removed.welcome().participant_id());
    owner.send(message);
    EXPECT_EQ(removed.readToTheEnd().error().code(), v1::ERROR_CODE_REMOVED);
    ASSERT_TRUE(store_->flush(30s));
    server().stop();
  }
  end();
  run();
  EXPECT_TRUE(live("small")->roster.isBanned({"acme", "eve"}));
  EXPECT_TRUE(live("other")->roster.isBanned({"acme", "eve"}));
  TestPeer again(server(), "again");
  again.hello(helloTo("other", token));
  EXPECT_EQ(again.readToTheEnd().error().code(), v1::ERROR_CODE_REMOVED);
  end();
  store_ = std::make_shared<SavedState>(SavedStateOptions{.directory = directory_.path()});
  model::Scene changed = tests::smallScene("other");
  changed.cloths[0].mass *= 2;
  const auto saved = store_->take(changed);
  ASSERT_TRUE(saved.has_value());
  EXPECT_EQ(saved->roster.bans.size(), 1u);
  EXPECT_EQ(saved->roster.refusedTokenHashes.size(), 1u);
  EXPECT_TRUE(saved->roster.participants.empty());
  EXPECT_FALSE(saved->checkpoint.has_value());
}

// A checkpoint that cannot be used costs neither the scene nor its participants.
TEST_F(SavedStateTest, ARefusedCheckpointCostsOnlyTheState) {
  START();
  create(tests::smallScene("mine"));
  std::string token;
  {
    TestPeer peer(server());
    peer.join("mine");
    token = peer.welcome().resume_token();
    v1::ParameterChange change;
    change.mutable_gravity()->mutable_value()->set_y(-3);
    peer.change(change);
    peer.readUntil(v1::ServerMessage::kParameterChanged);
    ASSERT_TRUE(eventually([&] { return live("mine")->keeper->savedAt().has_value(); }));
    server().stop();
  }
  end();
  {
    Database database({.directory = directory_.path() / "scenes"});
    ASSERT_TRUE(database.write("mine", {.checkpoint = v1::SavedCheckpoint().SerializeAsString()}));
  }
  run();
  ASSERT_NE(live("mine"), nullptr);
  EXPECT_EQ(live("mine")->tick.load(), 0u);
  EXPECT_EQ(live("mine")->definition().environment.gravity.y(), -3);
  TestPeer peer(server());
  peer.hello(helloTo("mine", token));
  peer.readFrames(1);
  EXPECT_TRUE(peer.welcome().resumed());
}

// A new participant never gets the number of one that only a checkpoint has.
TEST_F(SavedStateTest, NumbersOfParticipantsInACheckpointStayTaken) {
  START();
  create(tests::smallScene("mine"));
  std::uint64_t id = 0;
  {
    TestPeer peer(server());
    peer.join("mine");
    id = peer.welcome().participant_id();
    peer.poses({{1, 2}});
    peer.readUntil([](const v1::ServerMessage& message) { return message.frame().colliders_size() == 2; });
    server().stop();
  }
  end();
  {
    Database database({.directory = directory_.path() / "scenes"});
    ASSERT_TRUE(database.write("mine", {.session = v1::SavedSession().SerializeAsString()}));
  }
  run();
  TestPeer peer(server());
  peer.join("mine");
  EXPECT_GT(peer.welcome().participant_id(), id);
  peer.readFrames(1);
  EXPECT_EQ(peer.frames().back().colliders.size(), 1u);
}

TEST_F(SavedStateTest, AResetOfASleepingSceneIsNotLost) {
  START();
  create(tests::smallScene("mine"));
  {
    TestPeer peer(server());
    peer.join("mine");
    peer.readFrames(3);
    peer.leave();
  }
  ASSERT_TRUE(eventually([&] { return !live("mine")->running; }));
  live("mine")->resetRequested = true;
  ASSERT_TRUE(store_->flush(30s));
  end();
  run();
  EXPECT_TRUE(live("mine")->resetRequested);
}

// A definition that is larger than the database fails at each write.
TEST_F(SavedStateTest, ASceneThatCannotBeSavedDelaysNoOther) {
  START({}, kNoLimits, {.maxBytes = 200'000});
  model::Scene huge = tests::smallScene("huge");
  model::Cloth grid = huge.cloths[0];
  grid.grid.rows = grid.grid.columns = 100;
  grid.mass = 0.001f * static_cast<float>(grid.nodeCount());
  huge.cloths[0] = model::asMesh(grid);
  huge.simulationRate = huge.streamRate = 10;
  huge.cloths[0].structural.stiffness = huge.cloths[0].shear.stiffness = huge.cloths[0].bend.stiffness =
      0.001f;
  create(huge);
  create(tests::smallScene("mine"));
  EXPECT_TRUE(store_->flush(30s, "mine"));
  EXPECT_FALSE(store_->flush(30s, "huge"));
  EXPECT_FALSE(store_->flush(30s));
  TestPeer peer(server());
  peer.join("mine");
  ASSERT_TRUE(eventually([&] { return live("mine")->keeper->savedAt().has_value(); }));
  EXPECT_TRUE(store_->flush(30s, "mine"));
  EXPECT_GT(store_->status().failedWrites, 0u);
}

TEST_F(SavedStateTest, AnExceptionOfTheWriterLosesNothing) {
  std::atomic<bool> throws = true;
  START({}, kNoLimits, {.beforeWrite = [&](const std::string& name) {
          if (throws && name == "mine") throw std::runtime_error("no memory");
        }});
  create(tests::smallScene("mine"));
  create(tests::smallScene("healthy"));
  EXPECT_TRUE(store_->flush(30s, "healthy"));
  EXPECT_FALSE(store_->flush(30s, "mine"));
  throws = false;
  EXPECT_TRUE(store_->flush(30s, "mine"));
  end();
  run();
  EXPECT_THAT(names(), ::testing::IsSupersetOf({"mine", "healthy"}));
}

// States of scenes that the server no longer starts with make room for others.
TEST_F(SavedStateTest, UnusedStatesMakeRoom) {
  model::Scene unused = tests::smallScene("unused");
  unused.cloths[0].grid.rows = unused.cloths[0].grid.columns = 64;
  unused.cloths[0].mass = 0.001f * static_cast<float>(unused.cloths[0].nodeCount());
  START({}, kNoLimits, {}, {unused});
  {
    TestPeer peer(server());
    peer.join("unused");
    ASSERT_TRUE(eventually([&] { return live("unused")->keeper->savedAt().has_value(); }));
    server().stop();
  }
  end();
  run({}, kNoLimits, {.maxBytes = 150'000});
  model::Scene used = tests::smallScene("used");
  used.cloths[0].grid.rows = used.cloths[0].grid.columns = 32;
  used.cloths[0].mass = 0.001f * static_cast<float>(used.cloths[0].nodeCount());
  create(used);
  {
    TestPeer peer(server());
    peer.join("used");
    ASSERT_TRUE(eventually([&] { return live("used")->keeper->savedAt().has_value(); }));
    server().stop();
  }
  end();
  const Database database({.directory = directory_.path() / "scenes"});
  std::vector<std::string> left;
  for (const Database::Row& row : database.rows()) left.push_back(row.name);
  EXPECT_THAT(left, ::testing::Not(::testing::Contains("unused")));
  EXPECT_THAT(left, ::testing::Contains("used"));
}

TEST_F(SavedStateTest, LeavesOutTheLargestStateBeyondItsLimit) {
  START({}, kNoLimits, {.maxBytes = 100'000});
  model::Scene large = tests::smallScene("large");
  large.cloths[0].grid.rows = large.cloths[0].grid.columns = 64;
  large.cloths[0].mass = 0.001f * static_cast<float>(large.cloths[0].nodeCount());
  create(large);
  create(tests::smallScene("tiny"));
  {
    TestPeer inLarge(server()), inTiny(server());
    inLarge.join("large");
    inTiny.join("tiny");
    ASSERT_TRUE(eventually([&] { return store_->status().leftOut == 1 && live("tiny")->keeper->savedAt(); }));
    EXPECT_FALSE(live("large")->keeper->savedAt().has_value());
    server().stop();
  }
  end();
  run();
  EXPECT_EQ(live("large")->tick.load(), 0u);
  EXPECT_GT(live("tiny")->tick.load(), 0u);
}

TEST_F(SavedStateTest, SavesNothingMoreWhileTheDiskIsFull) {
  START({}, kNoLimits, {.minFreeBytes = UINT64_MAX / 2});
  create(tests::smallScene("mine"));
  {
    TestPeer peer(server());
    peer.join("mine");
    peer.readFrames(10);
    ASSERT_TRUE(store_->flush(10s));
    EXPECT_FALSE(live("mine")->keeper->savedAt().has_value());
    EXPECT_TRUE(live("mine")->keeper->unsavedSince().has_value());
    EXPECT_GE(store_->status().waiting, 1u);
    server().stop();
  }
  end();
  run();
  EXPECT_EQ(live("mine")->tick.load(), 0u) << "the scene is kept, and starts from the beginning";
}

TEST_F(SavedStateTest, WithoutAStoreNothingIsKept) {
  start();
  if (IsSkipped()) return;
  create(tests::smallScene("mine"));
  EXPECT_EQ(live("mine")->keeper, nullptr);
}

}  // namespace
}  // namespace clothstream::saved_state
