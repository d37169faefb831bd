// SPDX-License-Identifier: MIT
// Scenes that peers describe or upload in chunks.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <latch>
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <gtest/gtest.h>

#include "server/messages/scene_message.h"
#include "tests/model/meshes.h"
#include "tests/serving/hosting/scenes_test.h"

namespace clothstream::hosting {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using tests::TestPeer;
using Body = v1::ServerMessage;

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

v1::ServerMessage createUploaded(TestPeer& peer, const std::string& name = "") {
  v1::ClientMessage message;
  message.mutable_create_scene()->set_uploaded_content_id(9);
  message.mutable_create_scene()->set_name(name);
  return ask(peer, message);
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

// Six million empty pins are 12 MB of bytes, and were parsed to more than 400 MB before they were counted.
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
  EXPECT_EQ(error.code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(error.text(), HasSubstr("128000000 bytes of memory"));
}

TEST_F(ScenesTest, OptionsLimitTheParsedSizeAndTheSpringsOfANode) {
  ServerOptions options;
  options.maxParsedBytes = 1'000'000;
  options.maxNodeSprings = 5;
  START(options);
  TestPeer maker(server());
  v1::Scene scene = discScene(8);  // its vertices inside have six neighbours
  upload(maker, scene.SerializeAsString());
  const v1::Error springs = createUploaded(maker).error();
  EXPECT_EQ(springs.code(), v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_THAT(springs.text(), HasSubstr("has more than 5 springs"));
  for (int i = 0; i < 100'000; ++i) scene.mutable_cloths(0)->add_pins();
  upload(maker, scene.SerializeAsString());
  const v1::Error parsed = createUploaded(maker).error();
  EXPECT_EQ(parsed.code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(parsed.text(), HasSubstr("1000000 bytes of memory (--profile)"));
  EXPECT_EQ(server().metrics.refusals[static_cast<std::size_t>(telemetry::Refusal::sceneSize)].value(), 2u);
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
  EXPECT_EQ(server().unaryCalls.listScenes().scenes_size(), 2);
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
    server().unaryCalls.createScene(request, [&](const auto& answer) {
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

}  // namespace
}  // namespace clothstream::hosting
