// SPDX-License-Identifier: MIT
// Invalid messages get a clear error and do not affect other peers.
#include <limits>

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "server/messages/limits.h"
#include "server/scene/frame_schedule.h"
#include "server/session/session.h"
#include "tests/serving/server_test.h"

namespace clothstream::session {
namespace {

using namespace schedule;
using namespace scene;

using testing::HasSubstr;
using tests::TestPeer;
using Body = v1::ServerMessage;

// A bystander joins first. After each test it must still receive frames, and must have got no error.
class MisbehaviourTest : public tests::ServerTest {
 protected:
  void SetUp() override {
    start();
    if (IsSkipped()) return;
    bystander = std::make_unique<TestPeer>(server());
    bystander->join();
    culprit = std::make_unique<TestPeer>(server(), "culprit");
  }
  void TearDown() override {
    if (!bystander) return;
    const std::size_t before = bystander->frames().size();
    bystander->readUntil([&](const Body& message) {
      EXPECT_FALSE(message.has_error()) << message.error().text();
      return bystander->frames().size() >= before + 20;
    });
    EXPECT_FALSE(bystander->finished());
    culprit.reset();
    bystander.reset();
  }
  v1::Error nextError() { return culprit->readUntil(Body::kError).error(); }
  v1::Error fatalError() {
    const v1::Error error = culprit->readToTheEnd().error();
    EXPECT_TRUE(error.fatal());
    EXPECT_TRUE(culprit->finished());
    return error;
  }

  std::unique_ptr<TestPeer> bystander, culprit;
};

TEST(Messages, EachHasAHandler) {
  const google::protobuf::OneofDescriptor* const bodies =
      v1::ClientMessage::descriptor()->FindOneofByName("body");
  ASSERT_NE(bodies, nullptr);
  for (int i = 0; i < bodies->field_count(); ++i)
    EXPECT_TRUE(Session::handles(bodies->field(i)->number())) << bodies->field(i)->name();
  EXPECT_FALSE(Session::handles(v1::ClientMessage::BODY_NOT_SET));
}

TEST_F(MisbehaviourTest, GarbageIsRefusedThenDisconnected) {
  culprit->join();
  culprit->sendBytes("\xff\xff\xff\xff");
  const v1::Error error = nextError();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_MALFORMED_MESSAGE);
  EXPECT_FALSE(error.fatal());
  for (int i = 0; i < 20; ++i) culprit->sendBytes(std::string(100, '\x07'));
  EXPECT_EQ(fatalError().code(), v1::ERROR_CODE_MALFORMED_MESSAGE);
}

TEST_F(MisbehaviourTest, EveryTruncationOfAMessageIsHarmless) {
  v1::ClientMessage message;
  message.set_request_id(5);
  message.mutable_hello()->set_scene("small");
  message.mutable_hello()->add_codecs(2);
  const std::string bytes = message.SerializeAsString();
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    TestPeer peer(server());
    peer.sendBytes(bytes.substr(0, length));
    EXPECT_TRUE(peer.readUntil(Body::kError).has_error()) << length;
  }
}

TEST_F(MisbehaviourTest, RefusesTooLargeMessage) {
  culprit->join();
  culprit->sendBytes(std::string(messages::limits::kMaxClientMessageBytes + 1, '\0'));
  EXPECT_EQ(nextError().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
}

TEST_F(MisbehaviourTest, RefusesNonFinitePoseWithItsPath) {
  culprit->join();
  culprit->poses({{1, 0.5f}, {2, std::numeric_limits<float>::quiet_NaN()}});
  const v1::Error error = nextError();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_THAT(error.text(), HasSubstr("colliders[1].pose.position.x = nan"));
  culprit->readFrames(5);
  for (const v1::ColliderState& collider : culprit->frames().back().colliders)
    EXPECT_EQ(collider.participant_id(), 0u);
}

TEST_F(MisbehaviourTest, ChangeWithAnInvalidValueChangesNothing) {
  culprit->join();
  v1::ParameterChange change;
  change.mutable_wind()->mutable_value()->set_x(1);
  change.add_cloths()->set_name("nothing");
  culprit->change(change);
  const v1::ServerMessage answer = culprit->readUntil(Body::kError);
  EXPECT_EQ(answer.request_id(), 77u);
  EXPECT_THAT(answer.error().text(), HasSubstr("cloths[0].name = "));
  EXPECT_EQ(server().scenes.find("small")->definition().environment.wind.x(), 0);
}

TEST_F(MisbehaviourTest, UnknownSceneErrorListsTheScenes) {
  culprit->hello("nowhere");
  const v1::Error error = fatalError();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_NOT_FOUND);
  EXPECT_EQ(error.text(), "there is no scene 'nowhere'; there are small, other");
}

TEST_F(MisbehaviourTest, InputBeforeHelloIsOutOfOrder) {
  culprit->poses({{1, 0}});
  EXPECT_EQ(fatalError().code(), v1::ERROR_CODE_OUT_OF_ORDER);
}

TEST_F(MisbehaviourTest, SecondHelloIsOutOfOrder) {
  culprit->join();
  culprit->hello("other");
  EXPECT_EQ(fatalError().code(), v1::ERROR_CODE_OUT_OF_ORDER);
  EXPECT_EQ(server().unaryCalls.listScenes().scenes(0).participants(), 1u);
}

TEST_F(MisbehaviourTest, RefusesUnsupportedVersion) {
  v1::ClientMessage message;
  message.mutable_hello()->set_protocol_version(0);
  message.mutable_hello()->add_codecs(2);
  culprit->send(message);
  EXPECT_EQ(fatalError().code(), v1::ERROR_CODE_UNSUPPORTED_VERSION);
}

TEST_F(MisbehaviourTest, RefusesUnsupportedCodec) {
  v1::ClientMessage message;
  message.mutable_hello()->set_protocol_version(1);
  message.mutable_hello()->add_codecs(200);
  culprit->send(message);
  EXPECT_EQ(fatalError().code(), v1::ERROR_CODE_UNSUPPORTED_CODEC);
}

TEST_F(MisbehaviourTest, RefusesAcknowledgementOfFutureTick) {
  culprit->join();
  v1::ClientMessage ack;
  ack.mutable_frame_ack()->set_tick(1'000'000);
  culprit->send(ack);
  EXPECT_THAT(nextError().text(), HasSubstr("frame_ack.tick = 1000000"));
}

TEST_F(MisbehaviourTest, ExcessPosesAreIgnoredThenDisconnected) {
  culprit->join();
  for (int i = 0; i < 200; ++i) culprit->poses({{1, 0.001f * static_cast<float>(i)}});
  const v1::Error error = nextError();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_RATE_LIMITED);
  EXPECT_THAT(error.text(), HasSubstr("collider poses"));
  EXPECT_FALSE(error.fatal());
  for (int i = 0; i < 20'000 && !culprit->finished(); ++i) culprit->poses({{1, 0}});
  EXPECT_EQ(fatalError().code(), v1::ERROR_CODE_RATE_LIMITED);
}

TEST_F(MisbehaviourTest, FloodOfKeyFrameRequestsGivesFewKeyFrames) {
  culprit->join();
  const std::uint64_t before = metrics().keyFrames.value();
  const auto start = Clock::now();
  v1::ClientMessage request;
  request.mutable_key_frame_request();
  for (int i = 0; i < 60; ++i) {
    culprit->send(request);
    bystander->readFrames(1);
    culprit->readUntil([](const Body&) { return true; });
  }
  const double elapsed = seconds(Clock::now() - start);
  EXPECT_LE(static_cast<double>(metrics().keyFrames.value() - before),
            elapsed / seconds(FrameSchedule::kKeyFrameInterval) + 1);
}

TEST_F(MisbehaviourTest, OnePeerGetsAFewKeyFramesThenOneASecond) {
  culprit->join();
  v1::ClientMessage request;
  request.mutable_key_frame_request();
  // Whether the answer is a key frame, and not a refusal.
  const auto getsKeyFrame = [&] {
    culprit->send(request);
    const Body answer = culprit->readUntil([&](const Body& message) {
      return message.has_error() || (message.has_frame() && culprit->frames().back().key);
    });
    if (answer.has_error()) {
      EXPECT_EQ(answer.error().code(), v1::ERROR_CODE_RATE_LIMITED);
    }
    return !answer.has_error();
  };
  int keyFrames = 0;
  const auto start = Clock::now();
  while (keyFrames < 30 && getsKeyFrame()) ++keyFrames;
  EXPECT_GE(keyFrames, 3);
  EXPECT_LE(keyFrames, 3 + seconds(Clock::now() - start));
  culprit->readFrames(60);  // more than a second
  EXPECT_TRUE(getsKeyFrame()) << "a refused peer recovers";
}

}  // namespace
}  // namespace clothstream::session
