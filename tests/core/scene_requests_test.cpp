// SPDX-License-Identifier: MIT
// Requests about scenes: what is sent, how answers and refusals arrive, and uploads in pieces.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

constexpr std::uint32_t kAnswer = CS_EVENT_ANSWER;

cs_answer answerOf(const ClientUnderTest& client) {
  cs_answer answer{};
  EXPECT_EQ(cs_get_answer(client.get(), &answer), 1);
  return answer;
}

std::string errorFor(std::uint64_t requestId, v1::ErrorCode code, const std::string& text,
                     bool fatal = false) {
  v1::ServerMessage message;
  message.ParseFromString(ScriptedServer::error(code, text, fatal));
  message.set_request_id(requestId);
  return message.SerializeAsString();
}

v1::ServerMessage answerTo(std::uint64_t requestId) {
  v1::ServerMessage message;
  message.set_request_id(requestId);
  return message;
}

std::string pongTo(std::uint64_t requestId) {
  v1::ServerMessage message = answerTo(requestId);
  message.mutable_pong()->set_server_time_us(5);
  return message.SerializeAsString();
}

TEST(Scenes, ListHasSummaries) {
  JoinedClient joined;
  v1::ServerMessage message;
  v1::SceneSummary& flag = *message.mutable_list_scenes()->add_scenes();
  flag.set_name("flag");
  flag.set_description("A flag in the wind");
  flag.set_vertex_count(1200);
  flag.set_cloth_count(2);
  flag.set_participants(3);
  flag.set_max_participants(8);
  flag.set_running(true);
  flag.set_paused(true);
  flag.set_created(true);
  flag.set_recorded(true);
  message.mutable_list_scenes()->add_scenes()->mutable_playback();
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()), static_cast<std::uint32_t>(CS_EVENT_SCENES));
  cs_scene_summary scene{};
  ASSERT_EQ(cs_get_scene(joined.client.get(), 0, &scene), 1);
  EXPECT_STREQ(scene.name, "flag");
  EXPECT_STREQ(scene.description, "A flag in the wind");
  EXPECT_EQ(scene.vertex_count, 1200u);
  EXPECT_EQ(scene.cloth_count, 2u);
  EXPECT_EQ(scene.participants, 3u);
  EXPECT_EQ(scene.max_participants, 8u);
  EXPECT_EQ(scene.running + scene.paused + scene.created + scene.recorded, 4);
  EXPECT_EQ(scene.is_recording, 0);
  ASSERT_EQ(cs_get_scene(joined.client.get(), 1, &scene), 1);
  EXPECT_EQ(scene.is_recording, 1);
  EXPECT_EQ(scene.running + scene.paused + scene.created + scene.recorded, 0);
  EXPECT_EQ(cs_get_scene(joined.client.get(), 2, &scene), 0);
}

TEST(Scenes, RefusesLongDescription) {
  JoinedClient joined;
  v1::ServerMessage message;
  message.mutable_list_scenes()->add_scenes()->set_description(std::string(5000, 'x'));
  joined.client.receive(message.SerializeAsString());
  EXPECT_EQ(cs_get_state(joined.client.get()), CS_STATE_FAILED);
}

TEST(SceneRequests, NameTheJoinedSceneByDefault) {
  JoinedClient joined;
  cs_client* client = joined.client.get();
  const std::string own = cs_scene_name(client);
  ASSERT_FALSE(own.empty());
  EXPECT_NE(cs_reset_scene(client, ""), 0u);
  v1::ClientMessage sent = joined.sent();
  EXPECT_EQ(sent.control_scene().name(), own);
  EXPECT_TRUE(sent.control_scene().reset());
  EXPECT_FALSE(sent.control_scene().has_paused());
  cs_pause_scene(client, "flag", 1);
  sent = joined.sent();
  EXPECT_EQ(sent.control_scene().name(), "flag");
  EXPECT_TRUE(sent.control_scene().paused());
  EXPECT_FALSE(sent.control_scene().reset());
  cs_delete_scene(client, "");
  EXPECT_EQ(joined.sent().delete_scene().name(), own);
  cs_start_recording(client, "", "take_1");
  sent = joined.sent();
  EXPECT_EQ(sent.start_recording().scene(), own);
  EXPECT_EQ(sent.start_recording().name(), "take_1");
  cs_stop_recording(client, "");
  EXPECT_EQ(joined.sent().stop_recording().scene(), own);
  cs_request_definition(client, "flag");
  EXPECT_EQ(joined.sent().get_scene().name(), "flag");
  cs_list_bans(client, "");
  EXPECT_EQ(joined.sent().list_bans().scene(), own);
  cs_lift_ban(client, "", "ada");
  EXPECT_EQ(joined.sent().lift_ban().subject(), "ada");
  cs_copy_scene(client, "", "copy", 4);
  sent = joined.sent();
  EXPECT_EQ(sent.create_scene().named(), own);
  EXPECT_EQ(sent.create_scene().name(), "copy");
  EXPECT_EQ(sent.create_scene().max_participants(), 4u);
}

TEST(SceneRequests, AnswerHasIdKindAndContent) {
  JoinedClient joined;
  cs_client* client = joined.client.get();
  cs_answer none{};
  EXPECT_EQ(cs_get_answer(client, &none), 0);

  const std::uint64_t stops = cs_stop_recording(client, "");
  const std::uint64_t starts = cs_start_recording(client, "", "");
  ASSERT_NE(stops, starts);
  EXPECT_EQ(joined.client.outgoing().at(0).request_id(), stops);
  v1::ServerMessage started = answerTo(starts);
  started.mutable_start_recording()->set_file("take.mcap");
  EXPECT_EQ(joined.client.receive(started.SerializeAsString()), kAnswer);
  EXPECT_EQ(answerOf(joined.client).request, CS_REQUEST_START_RECORDING);
  EXPECT_EQ(answerOf(joined.client).request_id, starts);
  EXPECT_EQ(answerOf(joined.client).error, 0u);
  EXPECT_STREQ(answerOf(joined.client).name, "take.mcap");
  v1::ServerMessage stopped = answerTo(stops);
  stopped.mutable_stop_recording()->set_file("take.mcap");
  stopped.mutable_stop_recording()->set_bytes(1234);
  EXPECT_EQ(joined.client.receive(stopped.SerializeAsString()), kAnswer);
  EXPECT_EQ(answerOf(joined.client).bytes, 1234u);
  none.version = CS_ANSWER_VERSION + 1;
  EXPECT_EQ(cs_get_answer(client, &none), 0);
}

TEST(SceneRequests, DefinitionAndBansAreKept) {
  JoinedClient joined;
  cs_client* client = joined.client.get();
  std::size_t bytes = 1;
  EXPECT_EQ(cs_definition(client, &bytes), nullptr);
  EXPECT_EQ(bytes, 0u);
  v1::ServerMessage defined = answerTo(cs_request_definition(client, ""));
  defined.mutable_get_scene()->mutable_scene()->set_name("flag");
  EXPECT_EQ(joined.client.receive(defined.SerializeAsString()), kAnswer);
  const std::uint8_t* definition = cs_definition(client, &bytes);
  v1::Scene scene;
  ASSERT_TRUE(scene.ParseFromArray(definition, static_cast<int>(bytes)));
  EXPECT_EQ(scene.name(), "flag");

  v1::ServerMessage banned = answerTo(cs_list_bans(client, ""));
  banned.mutable_list_bans()->add_bans()->set_subject("ada");
  banned.mutable_list_bans()->mutable_bans(0)->set_display_name("Ada");
  EXPECT_EQ(joined.client.receive(banned.SerializeAsString()), kAnswer);
  ASSERT_EQ(cs_ban_count(client), 1u);
  cs_ban ban{};
  ASSERT_EQ(cs_get_ban(client, 0, &ban), 1);
  EXPECT_STREQ(ban.subject, "ada");
  EXPECT_STREQ(ban.display_name, "Ada");
  EXPECT_STREQ(ban.tenant, "");
  EXPECT_EQ(cs_get_ban(client, 1, &ban), 0);
}

TEST(SceneRequests, RefusalIsAnAnswerAndNoError) {
  JoinedClient joined;
  const std::uint64_t id = cs_delete_scene(joined.client.get(), "curtain");
  EXPECT_EQ(joined.client.receive(errorFor(id, v1::ERROR_CODE_INVALID_ARGUMENT, "started with this scene")),
            kAnswer);
  EXPECT_EQ(answerOf(joined.client).request, CS_REQUEST_DELETE_SCENE);
  EXPECT_EQ(answerOf(joined.client).error, v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_STREQ(answerOf(joined.client).error_text, "started with this scene");
  EXPECT_STREQ(cs_error_text(joined.client.get()), "");
  // Errors of other messages are reported as before.
  EXPECT_EQ(joined.client.receive(errorFor(0, v1::ERROR_CODE_INVALID_ARGUMENT, "wind")),
            static_cast<std::uint32_t>(CS_EVENT_ERROR));
  EXPECT_STREQ(cs_error_text(joined.client.get()), "wind");
}

TEST(SceneRequests, FatalErrorEndsTheClient) {
  JoinedClient joined;
  const std::uint64_t id = cs_delete_scene(joined.client.get(), "curtain");
  joined.client.receive(errorFor(id, v1::ERROR_CODE_RATE_LIMITED, "too many", true));
  EXPECT_EQ(cs_get_state(joined.client.get()), CS_STATE_FAILED);
}

TEST(SceneRequests, IgnoresAnswersWithoutRequest) {
  JoinedClient joined;
  v1::ServerMessage message = answerTo(99);
  message.mutable_delete_scene();
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()), 0u);
  // An answer of another kind than the request.
  message.set_request_id(cs_reset_scene(joined.client.get(), ""));
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()), 0u);
  EXPECT_EQ(cs_get_state(joined.client.get()), CS_STATE_JOINED);
}

TEST(SceneRequests, MalformedAnswerFails) {
  JoinedClient joined;
  v1::ServerMessage message = answerTo(cs_list_bans(joined.client.get(), ""));
  message.mutable_list_bans()->add_bans()->set_subject(std::string(5000, 'x'));
  joined.client.receive(message.SerializeAsString());
  EXPECT_EQ(cs_get_state(joined.client.get()), CS_STATE_FAILED);
  EXPECT_EQ(cs_reset_scene(joined.client.get(), ""), 0u);
}

TEST(SceneRequests, AtMostSixtyFourWait) {
  JoinedClient joined;
  std::vector<std::uint64_t> ids;
  for (int i = 0; i < 64; ++i) ids.push_back(cs_reset_scene(joined.client.get(), ""));
  EXPECT_EQ(cs_reset_scene(joined.client.get(), ""), 0u);
  EXPECT_EQ(joined.client.outgoing().size(), 64u);
  v1::ServerMessage message = answerTo(ids[5]);
  message.mutable_control_scene()->mutable_scene()->set_name("curtain");
  EXPECT_EQ(joined.client.receive(message.SerializeAsString()), kAnswer);
  EXPECT_STREQ(answerOf(joined.client).name, "curtain");
  EXPECT_NE(cs_reset_scene(joined.client.get(), ""), 0u);
}

TEST(SceneRequests, NeedAJoinedScene) {
  ClientUnderTest client;
  EXPECT_EQ(cs_reset_scene(client.get(), ""), 0u);
  const std::uint8_t scene[]{1};
  EXPECT_EQ(cs_create_scene(client.get(), scene, 1, "", 0), 0u);
}

std::string sceneOf(std::size_t bytes) {
  v1::Scene scene;
  scene.set_description(std::string(bytes, 'd'));
  return scene.SerializeAsString();
}

std::uint64_t create(const ClientUnderTest& client, const std::string& scene, const char* name) {
  return cs_create_scene(client.get(), reinterpret_cast<const std::uint8_t*>(scene.data()), scene.size(),
                         name, 0);
}

TEST(CreateScene, SmallSceneIsOneMessage) {
  JoinedClient joined;
  const std::string scene = sceneOf(1000);
  const std::uint64_t id = create(joined.client, scene, "mine");
  const v1::ClientMessage sent = joined.sent();
  EXPECT_EQ(sent.request_id(), id);
  EXPECT_EQ(sent.create_scene().name(), "mine");
  EXPECT_EQ(sent.create_scene().scene().SerializeAsString(), scene);
  v1::ServerMessage made = answerTo(id);
  made.mutable_create_scene()->mutable_scene()->set_name("mine");
  EXPECT_EQ(joined.client.receive(made.SerializeAsString()), kAnswer);
  EXPECT_EQ(answerOf(joined.client).request, CS_REQUEST_CREATE_SCENE);
  EXPECT_STREQ(answerOf(joined.client).name, "mine");
  EXPECT_STREQ(answerOf(joined.client).repairs, "");
}

TEST(CreateScene, AnswerListsRepairs) {
  JoinedClient joined;
  v1::ServerMessage made = answerTo(create(joined.client, sceneOf(10), "mine"));
  v1::MeshRepair& repair = *made.mutable_create_scene()->add_repairs();
  repair.add_sentences("2 faces without an area were dropped.");
  repair.add_sentences("3 triangles were turned.");
  EXPECT_EQ(joined.client.receive(made.SerializeAsString()), kAnswer);
  EXPECT_STREQ(answerOf(joined.client).repairs,
               "2 faces without an area were dropped.\n3 triangles were turned.");
  // A new answer has none.
  v1::ServerMessage reset = answerTo(cs_reset_scene(joined.client.get(), ""));
  reset.mutable_control_scene();
  joined.client.receive(reset.SerializeAsString());
  EXPECT_STREQ(answerOf(joined.client).repairs, "");
}

TEST(CreateScene, RefusesRepairsWithoutEnd) {
  JoinedClient joined;
  v1::ServerMessage made = answerTo(create(joined.client, sceneOf(10), "mine"));
  for (int i = 0; i < 100; ++i)
    made.mutable_create_scene()->add_repairs()->add_sentences(std::string(4000, 'x'));
  joined.client.receive(made.SerializeAsString());
  EXPECT_EQ(cs_get_state(joined.client.get()), CS_STATE_FAILED);
}

TEST(CreateScene, RefusesEmptyAndHugeScenes) {
  JoinedClient joined;
  const std::uint8_t scene[]{1};
  EXPECT_EQ(cs_create_scene(joined.client.get(), scene, 0, "", 0), 0u);
  EXPECT_EQ(cs_create_scene(joined.client.get(), scene, std::size_t{CS_MAX_SCENE_BYTES} + 1, "", 0), 0u);
  EXPECT_TRUE(joined.client.outgoing().empty());
}

// Serves an upload: takes pieces and answers the ping at the end of each window.
class UploadServer {
 public:
  explicit UploadServer(ClientUnderTest& client) : client_(client) {}

  // Takes what the client sends at this time. Returns the number of pieces.
  int take(std::uint64_t nowUs) {
    cs_update(client_.get(), nowUs);
    int pieces = 0;
    for (const v1::ClientMessage& message : client_.outgoing()) {
      EXPECT_LE(message.ByteSizeLong(), 64u * 1024);
      if (message.has_upload()) {
        EXPECT_EQ(message.upload().kind(), v1::CONTENT_KIND_SCENE);
        EXPECT_EQ(message.upload().index(), next++);
        content += message.upload().data();
        ids.push_back(message.upload().content_id());
        total = message.upload().total_bytes();
        count = message.upload().count();
        ++pieces;
      } else if (message.has_ping() && message.ping().client_time_us() == 0) {
        ping = message.request_id();
      } else if (message.has_create_scene()) {
        created = message;
      }
    }
    return pieces;
  }
  void pong(std::uint64_t nowUs) { client_.receive(pongTo(ping), nowUs); }

  std::string content;
  std::vector<std::uint64_t> ids;
  std::uint32_t next = 0, count = 0;
  std::uint64_t total = 0, ping = 0;
  v1::ClientMessage created;

 private:
  ClientUnderTest& client_;
};

TEST(CreateScene, LargeSceneIsUploadedInWindows) {
  JoinedClient joined;
  const std::string scene = sceneOf(600'000);  // ten pieces
  const std::uint64_t id = create(joined.client, scene, "large");
  UploadServer server(joined.client);
  std::uint64_t sent = 1, bytes = 0;
  EXPECT_EQ(cs_get_upload(joined.client.get(), &sent, &bytes), 1);
  EXPECT_EQ(sent, 0u);
  EXPECT_EQ(bytes, scene.size());
  EXPECT_EQ(create(joined.client, scene, "second"), 0u) << "one upload at a time";

  EXPECT_EQ(server.take(1000 * kMs), 4);
  EXPECT_EQ(server.take(2000 * kMs), 0) << "waits for the pong";
  server.pong(2000 * kMs);
  cs_get_upload(joined.client.get(), &sent, &bytes);
  EXPECT_EQ(sent, 4 * 60 * 1024u);
  EXPECT_EQ(server.take(2001 * kMs), 4);
  server.pong(2002 * kMs);
  EXPECT_EQ(server.take(2003 * kMs), 0) << "at most one window in 100 ms";
  EXPECT_EQ(server.take(2101 * kMs), 2);
  EXPECT_EQ(server.content, scene);
  EXPECT_EQ(server.total, scene.size());
  EXPECT_EQ(server.count, 10u);
  EXPECT_THAT(server.ids, ::testing::Each(server.created.create_scene().uploaded_content_id()));
  EXPECT_EQ(server.created.request_id(), id);
  EXPECT_EQ(server.created.create_scene().name(), "large");

  v1::ServerMessage made = answerTo(id);
  made.mutable_create_scene()->mutable_scene()->set_name("large");
  EXPECT_EQ(joined.client.receive(made.SerializeAsString()), kAnswer);
  EXPECT_EQ(cs_get_upload(joined.client.get(), &sent, &bytes), 0);
  EXPECT_NE(create(joined.client, scene, "second"), 0u);
}

TEST(CreateScene, RefusedPieceEndsTheUploadOnce) {
  JoinedClient joined;
  const std::uint64_t id = create(joined.client, sceneOf(600'000), "large");
  UploadServer server(joined.client);
  EXPECT_EQ(server.take(1000 * kMs), 4);
  const std::string refusal = errorFor(id, v1::ERROR_CODE_RESOURCE_EXHAUSTED, "no memory for uploads");
  EXPECT_EQ(joined.client.receive(refusal), kAnswer);
  EXPECT_STREQ(answerOf(joined.client).error_text, "no memory for uploads");
  EXPECT_EQ(joined.client.receive(refusal), 0u) << "for the other pieces of the window";
  server.pong(2000 * kMs);
  EXPECT_EQ(server.take(3000 * kMs), 0);
  std::uint64_t sent = 0, bytes = 0;
  EXPECT_EQ(cs_get_upload(joined.client.get(), &sent, &bytes), 0);
}

TEST(CreateScene, LostConnectionEndsUploadAndRequests) {
  JoinedClient joined;
  const std::uint64_t id = create(joined.client, sceneOf(600'000), "large");
  const std::uint64_t resets = cs_reset_scene(joined.client.get(), "");
  cs_disconnected(joined.client.get(), 1000 * kMs);
  std::uint64_t sent = 0, bytes = 0;
  EXPECT_EQ(cs_get_upload(joined.client.get(), &sent, &bytes), 0);
  cs_connecting(joined.client.get(), 1001 * kMs);
  for (const v1::ClientMessage& message : joined.client.outgoing()) EXPECT_TRUE(message.has_hello());
  for (const std::uint64_t request : {id, resets}) {
    v1::ServerMessage late = answerTo(request);
    late.mutable_control_scene();
    EXPECT_EQ(joined.client.receive(late.SerializeAsString()), 0u);
  }
}

// Acknowledgements and poses come before pieces.
TEST(CreateScene, PiecesWaitForOtherMessages) {
  JoinedClient joined;
  create(joined.client, sceneOf(100'000), "large");
  const cs_own_collider sphere = sphereAt(0, 1, 0, 0.1f);
  cs_set_colliders(joined.client.get(), &sphere, 1, 1000 * kMs);
  const std::vector<v1::ClientMessage> sent = joined.client.outgoing();
  ASSERT_GE(sent.size(), 2u);
  EXPECT_TRUE(sent[0].has_collider_poses());
  EXPECT_TRUE(sent[1].has_upload());
}

}  // namespace
}  // namespace clothstream::client
