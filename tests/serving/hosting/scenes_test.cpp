// SPDX-License-Identifier: MIT
// Scenes that peers create, delete, pause and reset.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <future>
#include <latch>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <gtest/gtest.h>

#include "server/hosting/give_answer.h"
#include "server/hosting/scene_maker.h"
#include "server/messages/scene_message.h"
#include "tests/model/meshes.h"
#include "tests/serving/server_test.h"

namespace clothstream::hosting {
namespace {

using namespace schedule;
using namespace delivery;
using namespace scene;

using testing::HasSubstr;
using testing::StartsWith;
using tests::TestPeer;
using Body = v1::ServerMessage;

#define START(...)    \
  start(__VA_ARGS__); \
  if (IsSkipped()) return

using ScenesTest = tests::ServerTest;

// A cloth with a triangle mesh, as a client describes it.
v1::Scene discScene(std::uint32_t rings) {
  model::Scene scene = tests::smallScene("disc");
  scene.cloths[0].mesh = std::make_shared<const model::Mesh>(model::makeMesh(model::disc(rings, 0.5f)));
  scene.cloths[0].mass = 0.2f;
  scene.cloths[0].pins.clear();
  scene.cloths[0].pinnedVertices = {0};
  scene.substeps = 30;
  return messages::toMessage(scene);
}

v1::ClientMessage piece(const std::string& content, std::uint32_t index, std::uint32_t count,
                        std::size_t bytesAPiece) {
  v1::ClientMessage message;
  v1::Chunk& chunk = *message.mutable_upload();
  chunk.set_content_id(9);
  chunk.set_kind(v1::CONTENT_KIND_SCENE);
  chunk.set_index(index);
  chunk.set_count(count);
  chunk.set_total_bytes(content.size());
  chunk.set_data(content.substr(index * bytesAPiece, bytesAPiece));
  return message;
}

void upload(TestPeer& peer, const std::string& content) {
  constexpr std::size_t kBytes = 40'000;
  const auto count = static_cast<std::uint32_t>((content.size() + kBytes - 1) / kBytes);
  for (std::uint32_t i = 0; i < count; ++i) peer.send(piece(content, i, count, kBytes));
}

v1::ServerMessage ask(TestPeer& peer, v1::ClientMessage message) {
  message.set_request_id(77);
  peer.send(message);
  return peer.readUntil([](const v1::ServerMessage& answer) { return answer.request_id() == 77; });
}

v1::ServerMessage createUploaded(TestPeer& peer, const std::string& name = "") {
  v1::ClientMessage message;
  message.mutable_create_scene()->set_uploaded_content_id(9);
  message.mutable_create_scene()->set_name(name);
  return ask(peer, message);
}

v1::ServerMessage createNamed(TestPeer& peer, const std::string& named, const std::string& name) {
  v1::ClientMessage message;
  message.mutable_create_scene()->set_named(named);
  message.mutable_create_scene()->set_name(name);
  return ask(peer, message);
}

v1::ServerMessage deleteScene(TestPeer& peer, const std::string& name) {
  v1::ClientMessage message;
  message.mutable_delete_scene()->set_name(name);
  return ask(peer, message);
}

v1::ServerMessage control(TestPeer& peer, const std::string& name, std::optional<bool> paused, bool reset) {
  v1::ClientMessage message;
  message.mutable_control_scene()->set_name(name);
  if (paused) message.mutable_control_scene()->set_paused(*paused);
  message.mutable_control_scene()->set_reset(reset);
  return ask(peer, message);
}

TEST_F(ScenesTest, RefusesCreateSceneAtOnceWhileTooManyScenesWait) {
  START();
  // The maker's thread may use both after the end of the test.
  const auto began = std::make_shared<std::promise<void>>();
  std::promise<void> mayEnd;
  v1::CreateSceneRequest unknown;
  unknown.set_named("no such scene");
  server().createScene(unknown, [began, end = mayEnd.get_future().share()](const auto&) {
    began->set_value();
    end.wait();  // the maker's thread stays busy, so all others wait
  });
  began->get_future().wait();
  for (std::uint32_t i = 0; i < SceneMaker::kMaxWaiting; ++i)
    server().createScene(unknown, [](const auto&) {});
  TestPeer peer(server());
  const v1::ServerMessage answer = createNamed(peer, "folds", "late");
  EXPECT_EQ(answer.error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(answer.error().text(), HasSubstr("64 scenes wait to be created; try again later"));
  mayEnd.set_value();
}

TEST_F(ScenesTest, CreatesAndJoinsASceneUploadedInChunks) {
  START();
  const v1::Scene scene = discScene(40);
  const std::string content = scene.SerializeAsString();
  ASSERT_GT(content.size(), 100'000u);
  TestPeer maker(server());
  upload(maker, content);
  const v1::ServerMessage made = createUploaded(maker);
  ASSERT_TRUE(made.has_create_scene()) << made.DebugString();
  EXPECT_EQ(made.create_scene().scene().name(), "disc");
  EXPECT_EQ(made.create_scene().scene().vertex_count(), 4921u);
  EXPECT_TRUE(made.create_scene().scene().created());

  TestPeer peer(server());
  peer.join("disc");
  peer.readFrames(3);
  EXPECT_EQ(peer.description().cloths(0).vertex_count(), 4921u);
  EXPECT_EQ(peer.decoder().positions().size(), 3 * 4921u);
  // The scene equals the uploaded one, because its message is the same.
  EXPECT_EQ(peer.description().cloths(0).triangles().size(), 3 * sizeof(std::uint32_t) * 6 * 40 * 40);

  // The content was consumed by the call.
  EXPECT_EQ(createUploaded(maker, "again").error().code(), v1::ERROR_CODE_NOT_FOUND);
}

// Six million empty pins are 12 MB of bytes, and were parsed to more than 400 MB before they were counted.
TEST_F(ScenesTest, RefusesTooManyNodes) {
  ServerOptions options;
  options.maxSceneNodes = 100;
  START(options);
  TestPeer maker(server());
  v1::ClientMessage message;
  v1::Scene& scene = *message.mutable_create_scene()->mutable_scene();
  scene = messages::toMessage(tests::smallScene("mine"));
  EXPECT_THAT(ask(maker, message).error().text(),
              HasSubstr("cloths: have 120 nodes in all; must have at most 100"));
  // 4 rings have 61 vertices, and 5 have 91; two such cloths are too many.
  scene = discScene(5);
  *scene.add_cloths() = scene.cloths(0);
  EXPECT_THAT(ask(maker, message).error().text(),
              HasSubstr("cloths: have 182 nodes in all; must have at most 100"));
  scene.mutable_cloths()->RemoveLast();
  EXPECT_TRUE(ask(maker, message).has_create_scene());
}

TEST_F(ScenesTest, RefusesUploadThatNeedsTooMuchMemory) {
  START();
  constexpr int kPins = 6'000'000;
  std::string cloth, content;
  {
    google::protobuf::io::StringOutputStream bytes(&cloth);
    google::protobuf::io::CodedOutputStream out(&bytes);
    for (int i = 0; i < kPins; ++i) {
      out.WriteTag(v1::Cloth::kPinsFieldNumber << 3 | 2);
      out.WriteVarint32(0);
    }
  }
  {
    google::protobuf::io::StringOutputStream bytes(&content);
    google::protobuf::io::CodedOutputStream out(&bytes);
    out.WriteTag(v1::Scene::kClothsFieldNumber << 3 | 2);
    out.WriteVarint32(static_cast<std::uint32_t>(cloth.size()));
    out.WriteString(cloth);
  }
  TestPeer maker(server());
  upload(maker, content);
  const v1::Error error = createUploaded(maker).error();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_MALFORMED_MESSAGE);
  EXPECT_THAT(error.text(), HasSubstr("134217728 bytes of memory"));
}

TEST_F(ScenesTest, CreatedSceneLivesUntilDeleted) {
  START();
  TestPeer maker(server());
  ASSERT_TRUE(createNamed(maker, "small", "mine").has_create_scene());
  EXPECT_EQ(server().listScenes().scenes_size(), 3);
  EXPECT_THAT(createNamed(maker, "small", "mine").error().text(), HasSubstr("already"));
  EXPECT_EQ(createNamed(maker, "nowhere", "x").error().code(), v1::ERROR_CODE_NOT_FOUND);
  EXPECT_THAT(createNamed(maker, "small", "No Name").error().text(), StartsWith("createScene.name = "));
  EXPECT_THAT(createNamed(maker, "../../etc/passwd", "x").error().text(), HasSubstr("there is no scene"));

  TestPeer inside(server()), outside(server());
  inside.join("mine");
  outside.join("small");
  ASSERT_TRUE(deleteScene(maker, "mine").has_delete_scene());
  const v1::ServerMessage last = inside.readToTheEnd();
  EXPECT_EQ(last.notice().kind(), v1::NOTICE_KIND_SCENE_DELETED);
  EXPECT_EQ(server().listScenes().scenes_size(), 2);
  outside.readFrames(3);
  EXPECT_EQ(deleteScene(maker, "mine").error().code(), v1::ERROR_CODE_NOT_FOUND);
  EXPECT_THAT(deleteScene(maker, "small").error().text(), HasSubstr("must be of a scene that was created"));
  // The name is free again.
  EXPECT_TRUE(createNamed(maker, "small", "mine").has_create_scene());
  TestPeer again(server());
  again.join("mine");
}

TEST_F(ScenesTest, DeletesUnusedCreatedScene) {
  ServerOptions options;
  options.sceneLifetime = std::chrono::milliseconds(300);
  options.reconnectGrace.place = std::chrono::seconds(0);
  START(options);
  TestPeer maker(server());
  ASSERT_TRUE(createNamed(maker, "small", "used").has_create_scene());
  TestPeer user(server());
  user.join("used");
  ASSERT_TRUE(createNamed(maker, "small", "unused").has_create_scene());
  const auto scenes = [&] { return server().listScenes().scenes_size(); };
  while (scenes() > 3) user.readFrames(1);
  user.readFrames(40);  // a second of the scene
  EXPECT_EQ(scenes(), 3);
  user.leave();
  const auto end = std::chrono::steady_clock::now() + TestPeer::kPatience;
  while (scenes() > 2 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(scenes(), 2);
}

// Notes which scenes are kept and forgotten.
class NotingStore final : public scene::SceneStore {
 public:
  std::optional<scene::SavedScene> take(const model::Scene&) override { return {}; }
  std::vector<scene::SavedScene> takeCreated() override { return {}; }
  std::shared_ptr<scene::SceneKeeper> keep(const std::shared_ptr<scene::LiveScene>& scene) override {
    if (scene->created) isKept = true;
    return nullptr;
  }
  void remove(const std::string& name) override { removed = name; }
  bool flush(std::chrono::milliseconds, const std::string&) override { return true; }
  scene::StoreStatus status() const override { return {}; }

  std::atomic<bool> isKept = false;
  std::string removed;
};

TEST_F(ScenesTest, ACancelledCreationIsNotKeptAndTheErrorSaysWhy) {
  const auto store = std::make_shared<NotingStore>();
  ServerOptions options;
  options.store = store;
  START(options);
  v1::CreateSceneRequest request;
  request.set_named("small");
  request.set_name("mine");
  const auto error = [&] {
    std::promise<std::string> done;
    // The peer leaves while the device loads the scene.
    server().createScene(
        request, [&](const auto& made) { done.set_value(made ? "" : made.error().text()); },
        identity::local(), [&] { return !store->isKept; });
    return done.get_future().get();
  };
  EXPECT_THAT(error(), HasSubstr("the peer that asked for it has left"));
  EXPECT_EQ(store->removed, "mine");
  server().stop();
  EXPECT_THAT(error(), HasSubstr("the server stops"));
}

TEST_F(ScenesTest, LimitsCreatedScenes) {
  ServerOptions options;
  options.maxCreatedScenes = 1;
  START(options);
  TestPeer maker(server());
  ASSERT_TRUE(createNamed(maker, "small", "one").has_create_scene());
  EXPECT_EQ(createNamed(maker, "small", "two").error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  ASSERT_TRUE(deleteScene(maker, "one").has_delete_scene());
  EXPECT_TRUE(createNamed(maker, "small", "two").has_create_scene());
}

TEST_F(ScenesTest, InvalidSceneIsRefusedWithTheReason) {
  START();
  TestPeer maker(server());
  v1::Scene scene = discScene(3);
  scene.mutable_cloths(0)->mutable_structural()->set_stiffness(-1);
  upload(maker, scene.SerializeAsString());
  const v1::ServerMessage refused = createUploaded(maker);
  EXPECT_EQ(refused.error().code(), v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_THAT(refused.error().text(),
              StartsWith("createScene.scene: cloths[0].structural.stiffness = -1: must be"));
  EXPECT_FALSE(refused.error().fatal());

  scene = discScene(3);
  scene.mutable_cloths(0)->mutable_mesh()->Clear();
  scene.mutable_cloths(0)->mutable_mesh()->set_file("/etc/passwd");
  upload(maker, scene.SerializeAsString());
  EXPECT_TRUE(createUploaded(maker).has_error());
  upload(maker, std::string(100, '\xff'));
  EXPECT_EQ(createUploaded(maker).error().code(), v1::ERROR_CODE_MALFORMED_MESSAGE);
  EXPECT_EQ(ask(maker,
                [] {
                  v1::ClientMessage message;
                  message.mutable_create_scene();
                  return message;
                }())
                .error()
                .code(),
            v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_EQ(server().listScenes().scenes_size(), 2);
}

TEST_F(ScenesTest, InvalidChunksAreRefusedAndDropTheUpload) {
  ServerOptions options;
  options.maxUploadBytes = 1000;
  START(options);
  TestPeer maker(server());
  const std::string content(600, '\xff');
  const auto refusal = [&](const v1::ClientMessage& message) {
    maker.send(message);
    return maker.readUntil(Body::kError).error().text();
  };
  EXPECT_THAT(refusal(piece(content, 1, 3, 200)), StartsWith("upload.index = 1"));
  maker.send(piece(content, 0, 3, 200));
  EXPECT_THAT(refusal(piece(content, 2, 3, 200)), StartsWith("upload.index = 2"));
  v1::ClientMessage wrong = piece(content, 0, 1, 600);
  wrong.mutable_upload()->set_total_bytes(601);
  EXPECT_THAT(refusal(wrong), StartsWith("upload.data: 600 bytes in all; upload.totalBytes is 601"));
  wrong = piece(content, 0, 2, 200);
  wrong.mutable_upload()->set_kind(v1::CONTENT_KIND_STREAM_DESCRIPTION);
  EXPECT_THAT(refusal(wrong), StartsWith("upload.kind = 1"));
  wrong = piece(content, 0, 2, 200);
  wrong.mutable_upload()->set_total_bytes(std::uint64_t{1} << 40);
  EXPECT_THAT(refusal(wrong), StartsWith("upload.totalBytes = "));
  EXPECT_EQ(createUploaded(maker).error().code(), v1::ERROR_CODE_NOT_FOUND);

  // Memory that one peer has reserved is not available to another until it is released.
  maker.send(piece(content, 0, 2, 300));
  maker.send(piece(content, 1, 2, 300));
  TestPeer other(server());
  other.send(piece(content, 0, 1, 600));
  EXPECT_EQ(other.readUntil(Body::kError).error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  maker.vanish();
  other.send(piece(content, 0, 1, 600));
  EXPECT_EQ(createUploaded(other).error().code(), v1::ERROR_CODE_MALFORMED_MESSAGE);
}

TEST_F(ScenesTest, UploadOccupiesTheBudgetUntilAnswered) {
  ServerOptions options;
  const v1::Scene scene = discScene(40);
  const std::string content = scene.SerializeAsString();
  options.maxUploadBytes = content.size() + content.size() / 2;
  std::latch refused(1);
  options.journals = [&](const model::Scene& made) {
    if (made.name == scene.name()) refused.wait();
    return nullptr;
  };
  START(options);
  TestPeer maker(server());
  upload(maker, content);
  v1::ClientMessage create;
  create.set_request_id(77);
  create.mutable_create_scene()->set_uploaded_content_id(9);
  maker.send(create);
  // The scene is being created, and is not ready before this request is refused.
  upload(maker, content);
  EXPECT_EQ(maker.readUntil(Body::kError).error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  refused.count_down();
  const v1::ServerMessage made =
      maker.readUntil([](const v1::ServerMessage& answer) { return answer.request_id() == 77; });
  EXPECT_TRUE(made.has_create_scene()) << made.DebugString();
  upload(maker, content);
  EXPECT_TRUE(createUploaded(maker, "again").has_create_scene());
}

TEST_F(ScenesTest, LimitsScenesWaitingToBeCreated) {
  ServerOptions options;
  options.maxCreatedScenes = 1;
  START(options);
  constexpr int kAsked = 200;
  std::latch answered(kAsked);
  std::atomic<int> refused = 0;
  v1::CreateSceneRequest request;
  *request.mutable_scene() = discScene(60);
  for (int i = 0; i < kAsked; ++i) {
    server().createScene(request, [&](const auto& answer) {
      if (!answer && answer.error().text().find("wait to be created") != std::string::npos) {
        EXPECT_EQ(answer.error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
        ++refused;
      }
      answered.count_down();
    });
  }
  answered.wait();
  EXPECT_GT(refused, 0);
}

TEST_F(ScenesTest, SceneHasItsOwnParticipantLimit) {
  ServerOptions options;
  options.maxParticipants = 5;
  START(options);
  TestPeer maker(server());
  v1::ClientMessage message;
  v1::CreateSceneRequest& create = *message.mutable_create_scene();
  create.set_named("small");
  create.set_name("duet");
  create.set_max_participants(6);
  EXPECT_THAT(ask(maker, message).error().text(),
              StartsWith("createScene.maxParticipants = 6: must be at most 5"));
  create.set_max_participants(2);
  EXPECT_EQ(ask(maker, message).create_scene().scene().max_participants(), 2u);
  EXPECT_EQ(createNamed(maker, "small", "usual").create_scene().scene().max_participants(), 5u);

  TestPeer first(server()), second(server()), third(server());
  first.join("duet");
  second.join("duet");
  third.hello("duet");
  EXPECT_THAT(third.readToTheEnd().error().text(), HasSubstr("'duet' has 2 participants"));
}

// A journal whose functions throw.
class TroubledJournal : public Journal {
 public:
  messages::Result<std::string> start(const std::string&) override { throw std::runtime_error("no start"); }
  messages::Result<v1::StopRecordingResponse> stop() override { throw std::runtime_error("no stop"); }
  bool active() const override { return false; }
  bool due() const override { return false; }
  void begin(const vulkan::DeviceInfo&, const model::Scene&, const v1::StreamDescription&,
             const simulation::StateSnapshot&, const simulation::StateSnapshot&) override {}
  void ticked(const AppliedTick&) override {}
  void saved(const simulation::StateSnapshot&) override {}
  void restored(std::uint64_t, const simulation::StateSnapshot&) override {}
  void end() override {}
  void sent(const SharedBytes&) override {}
  void joined(std::uint64_t, const std::string&, const std::string&) override {}
  void left(std::uint64_t) override {}
};

TEST_F(ScenesTest, RecordingExceptionsBecomeErrors) {
  ServerOptions options;
  options.journals = [](const model::Scene&) { return std::make_shared<TroubledJournal>(); };
  START(std::move(options));
  TestPeer peer(server());
  peer.join();
  v1::ClientMessage message;
  message.mutable_start_recording()->set_scene("small");
  EXPECT_EQ(ask(peer, message).error().text(), "startRecording: failed on the server: no start");
  message.mutable_stop_recording()->set_scene("small");
  EXPECT_EQ(ask(peer, message).error().text(), "stopRecording: failed on the server: no stop");
  ASSERT_TRUE(createNamed(peer, "small", "mine").has_create_scene());
  EXPECT_TRUE(deleteScene(peer, "mine").has_delete_scene());
}

// Blocks the device's thread between two ticks, from block() to release().
class BlockingJournal : public TroubledJournal {
 public:
  bool due() const override {
    std::unique_lock lock(mutex_);
    waits_ = blocks_;
    changed_.notify_all();
    changed_.wait(lock, [this] { return !blocks_; });
    waits_ = false;
    return false;
  }
  // Returns when the thread waits.
  void block() {
    std::unique_lock lock(mutex_);
    blocks_ = true;
    changed_.wait(lock, [this] { return waits_; });
  }
  void release() {
    const std::lock_guard lock(mutex_);
    blocks_ = false;
    changed_.notify_all();
  }

 private:
  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  mutable bool waits_ = false;
  bool blocks_ = false;
};

TEST_F(ScenesTest, CancelsASceneThatTheDeviceDoesNotLoad) {
  ServerOptions options;
  const auto journal = std::make_shared<BlockingJournal>();
  options.journals = [journal](const model::Scene& scene) -> std::shared_ptr<Journal> {
    return scene.name == "small" ? journal : nullptr;
  };
  START(std::move(options));
  TestPeer peer(server());
  peer.join();
  journal->block();
  // Only a wait that checks for cancellation asks this often.
  constexpr int kChecks = 30;
  std::atomic<int> checks = 0;
  std::promise<std::string> answered;
  std::future<std::string> answer = answered.get_future();
  v1::CreateSceneRequest request;
  request.set_named("small");
  request.set_name("stuck");
  server().createScene(
      request, [&](const auto& created) { answered.set_value(created ? "" : created.error().text()); },
      identity::local(), [&] { return ++checks < kChecks; });
  const bool inTime = answer.wait_for(TestPeer::kPatience) == std::future_status::ready;
  // Requests after it are answered as well while the device is stuck.
  v1::StopRecordingRequest stopping;
  stopping.set_scene("nowhere");
  std::promise<void> stopped;
  server().stopRecording(stopping, [&](const auto&) { stopped.set_value(); });
  if (inTime) stopped.get_future().wait();
  journal->release();
  ASSERT_TRUE(inTime);
  EXPECT_THAT(answer.get(),
              StartsWith("createScene: cancelled, because the peer that asked for it has left"));
  peer.readFrames(3);
  EXPECT_EQ(server().listScenes().scenes_size(), 2);
  EXPECT_TRUE(createNamed(peer, "small", "stuck").has_create_scene()) << "the name is free again";
}

TEST_F(ScenesTest, RefusesOtherRequestsWhileTooManyWait) {
  START();
  const auto began = std::make_shared<std::promise<void>>();
  std::promise<void> mayEnd;
  v1::CreateSceneRequest unknown;
  unknown.set_named("no such scene");
  server().createScene(unknown, [began, end = mayEnd.get_future().share()](const auto&) {
    began->set_value();
    end.wait();  // the maker's thread stays busy, so all others wait
  });
  began->get_future().wait();
  v1::DeleteSceneRequest request;
  request.set_name("small");
  for (std::uint32_t i = 0; i < SceneMaker::kMaxWaiting; ++i)
    server().deleteScene(request, [](const auto&) {});
  TestPeer peer(server());
  EXPECT_THAT(deleteScene(peer, "small").error().text(),
              StartsWith("deleteScene: 64 requests about scenes wait; try again later"));
  v1::ClientMessage message;
  message.mutable_start_recording()->set_scene("small");
  EXPECT_THAT(ask(peer, message).error().text(), StartsWith("startRecording: 64 requests about scenes wait"));
  message.mutable_stop_recording()->set_scene("small");
  EXPECT_THAT(ask(peer, message).error().text(), StartsWith("stopRecording: 64 requests about scenes wait"));
  const auto counter = static_cast<std::size_t>(telemetry::Refusal::waitingScenes);
  EXPECT_EQ(server().state().metrics.refusals[counter].value(), 3u);
  mayEnd.set_value();
}

TEST(GiveAnswer, GivesAnErrorIfTheAnswerThrows) {
  using Answer = tl::expected<v1::DeleteSceneResponse, v1::Error>;
  int calls = 0;
  std::string text;
  const auto done = [&](const Answer& answer) {
    if (++calls <= 2) throw std::bad_alloc();
    text = answer ? "" : answer.error().text();
  };
  giveAnswer("deleteScene", done, Answer(v1::DeleteSceneResponse()));
  EXPECT_EQ(calls, 3);
  EXPECT_EQ(text, "deleteScene: the server could not give the answer; check whether it took effect");
}

TEST_F(ScenesTest, LimitsPausesAndResetsOfOneParticipant) {
  START();
  v1::ControlSceneRequest request;
  request.set_paused(false);
  std::string text;
  for (int i = 0; i <= 10 * LiveScene::kChangesOfParticipantPerSecond && text.empty(); ++i)
    if (const auto controlled = server().state().controlScene(request, 1); !controlled)
      text = controlled.error().text();
  EXPECT_EQ(
      text,
      "controlScene: too many changes of 'small' by one participant in one second; send it again later");
  EXPECT_TRUE(server().state().controlScene(request, 2)) << "another participant may";
}

TEST_F(ScenesTest, BuiltInScenesShareTheDeviceAsGuests) {
  ServerOptions options;
  options.guestScenes = {"small", "other"};
  START(std::move(options), {tests::smallScene("own")});
  TestPeer peer(server());
  ASSERT_TRUE(createNamed(peer, "small", "mine").has_create_scene());
  EXPECT_FALSE(server().state().find("small")->isGuest()) << "it is the default scene";
  EXPECT_TRUE(server().state().find("other")->isGuest());
  EXPECT_FALSE(server().state().find("own")->isGuest());
  EXPECT_TRUE(server().state().find("mine")->isGuest());
}

TEST_F(ScenesTest, PausedSceneStandsStillAndContinues) {
  START();
  TestPeer peer(server()), other(server());
  peer.join();
  other.join("other");
  ASSERT_TRUE(control(other, "small", true, false).control_scene().scene().paused());
  peer.readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_PAUSED; });
  // Frames in flight at the start of the pause arrive within a few ticks of another scene.
  other.readFrames(4);
  const std::uint64_t ticks = metrics().ticks.value();
  other.readFrames(10);
  EXPECT_EQ(metrics().ticks.value(), ticks);
  EXPECT_FALSE(server().listScenes().scenes(0).running());
  // Also announced to a peer that joins now.
  TestPeer late(server());
  late.hello();
  late.readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_PAUSED; });
  // The shape of the cloth is kept as well.
  late.readFrames(1);
  EXPECT_EQ(late.frames().back().tick, ticks);
  EXPECT_EQ(metrics().ticks.value(), ticks);

  ASSERT_FALSE(control(other, "small", false, false).control_scene().scene().paused());
  peer.readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_RESUMED; });
  peer.readFrames(5);
  EXPECT_LT(peer.frames().back().tick, ticks + 20);
  late.readFrames(5);
  EXPECT_LT(late.frames().back().tick, ticks + 20);
  EXPECT_EQ(control(other, "nowhere", true, false).error().code(), v1::ERROR_CODE_NOT_FOUND);
}

TEST_F(ScenesTest, ResetSceneRestartsWithItsPresentParameters) {
  START();
  TestPeer peer(server());
  peer.join();
  v1::ParameterChange change;
  change.mutable_gravity()->mutable_value();  // zero gravity
  peer.change(change);
  peer.readFrames(20);
  const auto lowest = [&] {
    float y = 1e9f;
    for (std::size_t i = 1; i < peer.decoder().positions().size(); i += 3)
      y = std::min(y, peer.decoder().positions()[i]);
    return y;
  };
  ASSERT_TRUE(control(peer, "", std::nullopt, true).has_control_scene());
  peer.readUntil([](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_RESET; });
  peer.readFrames(3);
  // The cloth is at rest without gravity, except where the ball pushes it.
  EXPECT_NEAR(lowest(), -1.1f, 0.02f);
  EXPECT_EQ(peer.description().definition().name(), "small");
  EXPECT_EQ(server().getScene({}).value().scene().environment().gravity().y(), 0);
}

TEST_F(ScenesTest, ResetOfAPausedSceneIsShown) {
  model::Scene sparse = tests::smallScene("sparse");  // streams every third tick
  sparse.simulationRate = 60;
  sparse.streamRate = 20;
  sparse.colliders.clear();
  sparse.environment.wind = model::Vec3(0, 0, 5);
  ServerOptions options;
  options.adaptsToLoad = false;  // a busy machine would halve the stream rate
  START(options, {sparse});
  TestPeer peer(server()), other(server());
  peer.join("sparse");
  const auto farthest = [&] {  // largest distance from the plane of the start
    float z = 0;
    for (std::size_t i = 2; i < peer.decoder().positions().size(); i += 3)
      z = std::max(z, std::abs(peer.decoder().positions()[i]));
    return z;
  };
  other.join("other");
  peer.readFrames(20);
  control(other, "sparse", true, false);
  peer.readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_PAUSED; });
  // Frames in flight at the start of the pause arrive within a few ticks of another scene.
  other.readFrames(4);
  const telemetry::SceneMetrics& metrics = server().state().find("sparse")->metrics;
  const std::uint64_t ticks = metrics.ticks.value();
  const float before = farthest();

  control(other, "sparse", std::nullopt, true);
  peer.readUntil([](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_RESET; });
  while (peer.frames().back().tick <= ticks) peer.readFrames(1);
  const std::uint64_t shown = peer.frames().back().tick;
  EXPECT_EQ(shown % 3, 0u);
  EXPECT_LE(shown, ticks + 3);
  // The wind has acted for at most three ticks, compared with a second before the pause.
  EXPECT_LT(farthest(), before / 10);
  other.readFrames(4);
  EXPECT_EQ(metrics.ticks.value(), shown);
  EXPECT_FALSE(server().state().find("sparse")->running);
}

// A scene with tables of 590,000 constraints. Loading it takes many times longer than a tick of the others.
model::Scene heavyScene() {
  model::Scene heavy = tests::smallScene("heavy");
  model::Cloth& cloth = heavy.cloths[0];
  cloth.grid.rows = cloth.grid.columns = 256;
  cloth.pins[0].lastColumn = 255;
  cloth.solver.kind = model::SolverKind::constraint;
  heavy.substeps = 1;
  return heavy;
}

// A scene with many ticks per second, so that several of them fall into the loading, also on a fast machine.
model::Scene lightScene() {
  model::Scene light = tests::smallScene("light");
  light.simulationRate = light.streamRate = 200;
  light.substeps = 3;
  return light;
}

// The light scene runs while a peer joins the heavy one.
class HeavySceneTest : public tests::ServerTest {
 protected:
  void SetUp() override {
    START({}, {heavyScene(), lightScene()});
    light = std::make_unique<TestPeer>(server());
    heavy = std::make_unique<TestPeer>(server());
    light->join("light");
    heavy->hello("heavy");
  }
  bool heavyRuns() { return server().state().find("heavy")->running; }

  std::unique_ptr<TestPeer> light, heavy;
};

TEST_F(HeavySceneTest, OtherScenesContinueWhileItLoads) {
  const Clock::time_point asked = Clock::now();
  Clock::time_point last = asked;
  Clock::duration longest{};
  int frames = 0;
  for (; !heavyRuns(); ++frames) {
    light->readFrames(1);
    const Clock::time_point now = Clock::now();
    longest = std::max(longest, now - std::exchange(last, now));
  }
  fmt::print("made ready in {:.0f} ms; another scene's {} frames meanwhile at most {:.0f} ms apart\n",
             1e3 * seconds(last - asked), frames, 1e3 * seconds(longest));
  // Two frames and one tick may be in flight at the beginning.
  EXPECT_GE(frames, 8);
  heavy->readFrames(1);
}

TEST_F(HeavySceneTest, IsLoadedAgainAfterADeviceLoss) {
  light->readFrames(2);
  server().state().device.simulateDeviceLoss();
  light->readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_DEVICE_REBUILT; });
  heavy->readFrames(1);
  light->readFrames(3);
}

TEST_F(HeavySceneTest, ServerStopsWhileItLoads) {
  light->readFrames(2);
  v1::CreateSceneRequest request;
  request.set_named("heavy");
  request.set_name("heavier");
  std::promise<void> answered;
  server().createScene(request, [&](const auto&) { answered.set_value(); });
  light->vanish();
  heavy->vanish();
  stop();
  answered.get_future().get();
}

}  // namespace
}  // namespace clothstream::hosting
