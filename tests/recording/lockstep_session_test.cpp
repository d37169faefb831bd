// SPDX-License-Identifier: MIT
// Sessions with a recording that is played in lockstep: what the server asks of a client, and what it allows.
#include <chrono>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/hosting/scene_server.h"
#include "server/recording/playback.h"
#include "tests/recording/sample.h"
#include "tests/recording/viewer.h"
#include "tests/serving/test_peer.h"

namespace clothstream::recording {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using tests::TestPeer;
using Body = v1::ServerMessage;

class LockstepSession : public ::testing::Test {
 protected:
  static std::shared_ptr<Playback> played(const PlaybackOptions& options) {
    return std::make_shared<Playback>(streamOf(sampleRecording(kSampleFrames)), options);
  }

  hosting::SceneServer server{"sample", played({.speed = kUnpaced, .lockstep = true}), {}};
};

TEST_F(LockstepSession, AsksForEveryAcknowledgement) {
  TestPeer peer(server);
  peer.join();
  EXPECT_TRUE(peer.welcome().acknowledge_every_frame());
  hosting::SceneServer usual("sample", played({}), {});
  TestPeer other(usual);
  other.join();
  EXPECT_FALSE(other.welcome().acknowledge_every_frame());
}

TEST_F(LockstepSession, CutsOffAClientThatDoesNotAcknowledge) {
  TestPeer peer(server);
  peer.acknowledges = false;
  peer.join();
  const auto checkAfter = [&](Clock::duration time) {
    for (const auto& known : server.connections.peers()) known->checkSilence(Clock::now() + time);
  };
  checkAfter(29s);
  EXPECT_FALSE(peer.finished());
  checkAfter(31s);
  const v1::Error error = peer.readToTheEnd().error();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_CUT_OFF);
  EXPECT_THAT(error.text(), HasSubstr("has not acknowledged the frame of tick 1 within 30 s"));
  EXPECT_THAT(error.text(), HasSubstr("welcome.acknowledge_every_frame"));
}

TEST_F(LockstepSession, AnswersEveryKeyFrameRequest) {
  TestPeer peer(server);
  peer.acknowledges = false;
  peer.join();
  v1::ClientMessage request;
  request.mutable_key_frame_request()->set_epoch(peer.description().epoch());
  for (std::size_t frames = 2; frames <= 6; ++frames) {
    peer.send(request);
    peer.readFrames(1);
    ASSERT_EQ(peer.frames().size(), frames);
    EXPECT_TRUE(peer.frames().back().key);
    // The only client gets the key frame before again.
    EXPECT_EQ(peer.frames().back().stateHash, peer.frames().front().stateHash);
  }
}

TEST_F(LockstepSession, LimitsAcknowledgementsThatNoFrameWaitsFor) {
  TestPeer peer(server);
  peer.acknowledges = false;
  peer.join();
  v1::ClientMessage ack;
  ack.mutable_frame_ack()->set_tick(0);
  for (int i = 0; i < 5000 && !peer.finished(); ++i) peer.send(ack);
  EXPECT_EQ(peer.readUntil(Body::kError).error().code(), v1::ERROR_CODE_RATE_LIMITED);
}

}  // namespace
}  // namespace clothstream::recording
