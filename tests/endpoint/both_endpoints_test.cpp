// SPDX-License-Identifier: MIT
// Clients of both endpoints share one scene.
#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/endpoint/small_server.h"
#include "tests/endpoint/transport.h"

namespace clothstream::tests {
namespace {

class BothEndpoints : public SmallServer {
 protected:
  void SetUp() override {
    SmallServer::SetUp();
    if (IsSkipped()) return;
    grpc_->open(server());
    web_->open(server());
  }
  void TearDown() override {
    grpc_->close();
    web_->close();
    SmallServer::TearDown();
  }

  void expectColliderIsSeen(Transport& moverTransport, Transport& watcherTransport) {
    Joined mover(moverTransport.connect()), watcher(watcherTransport.connect());
    ASSERT_GT(mover.viewer.frames, 0U);
    ASSERT_GT(watcher.viewer.frames, 0U);
    const std::uint64_t id = mover.viewer.welcome.participant_id();
    EXPECT_NE(id, watcher.viewer.welcome.participant_id());
    mover.client->send(colliderPose(0.5f));
    ASSERT_TRUE(watcher.seeUntil([&] { return watcher.viewer.colliderOf(id).has_value(); }));
    EXPECT_FLOAT_EQ(watcher.viewer.colliderOf(id)->position().x(), 0.5f);
    mover.client->send(colliderPose(std::nullopt));
    EXPECT_TRUE(watcher.seeUntil([&] { return !watcher.viewer.colliderOf(id).has_value(); }));
  }

  // A participant whose connection is lost through one endpoint resumes through the other.
  void expectResumes(Transport& lost, Transport& other) {
    Joined watcher(grpc_->connect());
    ASSERT_GT(watcher.viewer.frames, 0U);
    Joined before(lost.connect());
    const v1::Welcome& welcome = before.viewer.welcome;
    before.client->disconnect();
    ASSERT_TRUE(watcher.seeUntil([&] {
      const v1::Presence& presence = watcher.viewer.last.presence();
      return presence.kind() == v1::PRESENCE_KIND_DISCONNECTED &&
             presence.participant().id() == welcome.participant_id();
    }));
    v1::ClientMessage message;
    ASSERT_TRUE(message.ParseFromString(hello()));
    message.mutable_hello()->set_resume_token(welcome.resume_token());
    const auto client = other.connect();
    Viewer after;
    client->send(message.SerializeAsString());
    ASSERT_TRUE(client->watch(after, [&] { return after.frames > 0; }));
    EXPECT_TRUE(after.welcome.resumed());
    EXPECT_EQ(after.welcome.participant_id(), welcome.participant_id());
  }

  const std::unique_ptr<Transport> grpc_ = makeGrpcTransport(), web_ = makeWebTransport();
};

TEST_F(BothEndpoints, ShowGrpcColliderToWebSocketClient) {
  expectColliderIsSeen(*grpc_, *web_);
}

TEST_F(BothEndpoints, ShowWebSocketColliderToGrpcClient) {
  expectColliderIsSeen(*web_, *grpc_);
}

TEST_F(BothEndpoints, ResumeGrpcParticipantThroughWebSocket) {
  expectResumes(*grpc_, *web_);
}

TEST_F(BothEndpoints, ResumeWebSocketParticipantThroughGrpc) {
  expectResumes(*web_, *grpc_);
}

TEST_F(BothEndpoints, SendTheSamePacketForTheSameTick) {
  Joined web(web_->connect()), grpc(grpc_->connect());
  ASSERT_GT(web.viewer.frames, 0U);
  ASSERT_GT(grpc.viewer.frames, 0U);
  for (int common = 0; common < 5;) {
    const std::uint64_t webTick = web.viewer.tick(), grpcTick = grpc.viewer.tick();
    if (webTick < grpcTick) {
      ASSERT_TRUE(web.seeUntil([&] { return web.viewer.tick() >= grpcTick; }));
    } else if (grpcTick < webTick) {
      ASSERT_TRUE(grpc.seeUntil([&] { return grpc.viewer.tick() >= webTick; }));
    } else {
      EXPECT_EQ(web.viewer.frame.SerializeAsString(), grpc.viewer.frame.SerializeAsString());
      ++common;
      ASSERT_TRUE(web.seeUntil([&] { return web.viewer.tick() > webTick; }));
    }
  }
}

}  // namespace
}  // namespace clothstream::tests
