// SPDX-License-Identifier: MIT
// Failures that end at their scene, while the device goes on.
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/serving/hosting/scenes_test.h"

namespace clothstream::hosting {
namespace {

using testing::HasSubstr;
using tests::TestPeer;

class SceneFailureTest : public tests::ServerTest {
 protected:
  // Lets the scene fail this often. If a tick fails, the second time is while it is rebuilt, and the third
  // one ends that.
  void fail(const std::string& scene, int times) { server().device.simulateFailuresIn(scene, times); }
  // Reads what a participant of "small" has received.
  void expectUndisturbed(TestPeer& peer) {
    int frames = 0;
    peer.readUntil([&](const v1::ServerMessage& message) {
      EXPECT_NE(message.notice().kind(), v1::NOTICE_KIND_DEVICE_REBUILT);
      return message.has_frame() && ++frames == 3;
    });
    EXPECT_EQ(server().metrics.deviceRebuilds.value(), 0u);
    EXPECT_EQ(server().metrics.quarantines.value(), 0u);
  }
};

TEST_F(SceneFailureTest, FailedTickEndsAtItsScene) {
  START();
  TestPeer honest(server()), peer(server());
  honest.join("small");
  peer.join("other");
  fail("other", 3);
  EXPECT_THAT(peer.readToTheEnd().error().text(),
              HasSubstr("the device cannot run the scene 'other': a failure in a scene is simulated"));
  expectUndisturbed(honest);
  TestPeer again(server());
  again.join("other");
}

TEST_F(SceneFailureTest, SceneGoesOnAfterAFailedTick) {
  START();
  TestPeer honest(server()), peer(server());
  honest.join("small");
  peer.join("other");
  fail("other", 2);
  const v1::ServerMessage rebuilt = peer.readUntil([](const v1::ServerMessage& message) {
    return message.notice().kind() == v1::NOTICE_KIND_DEVICE_REBUILT;
  });
  EXPECT_THAT(rebuilt.notice().text(), testing::StartsWith("a tick failed; the scene goes on from"));
  peer.readFrames(1);
  expectUndisturbed(honest);
}

TEST_F(SceneFailureTest, FailedPausedFrameEndsAtItsScene) {
  START();
  TestPeer honest(server()), peer(server());
  honest.join("small");
  peer.join("other");
  v1::ClientMessage pause;
  pause.mutable_control_scene()->set_name("other");
  pause.mutable_control_scene()->set_paused(true);
  ASSERT_TRUE(ask(honest, pause).has_control_scene());
  peer.readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_PAUSED; });
  fail("other", 3);
  EXPECT_THAT(peer.readToTheEnd().error().text(), HasSubstr("a failure in a scene is simulated"));
  expectUndisturbed(honest);
}

TEST_F(SceneFailureTest, FailedBatchEndsAtItsScenes) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP()
      << "ticks take longer than a period with the thread sanitizer, and so begin alone, in no batch";
#endif
  // The pause after an error is longer than a period of these scenes, so that both are due after it. With one
  // substep, their ticks are short on a slow device, too: long ones begin alone.
  std::vector<model::Scene> pair{tests::smallScene("left"), tests::smallScene("right")};
  for (model::Scene& scene : pair) {
    scene.simulationRate = scene.streamRate = 100;
    scene.substeps = 1;
  }
  START({}, pair);
  TestPeer left(server()), right(server());
  left.join("left");
  right.join("right");
  server().device.simulateFailedBatch();
  for (TestPeer* peer : {&left, &right}) {
    const v1::ServerMessage rebuilt = peer->readUntil([](const v1::ServerMessage& message) {
      return message.notice().kind() == v1::NOTICE_KIND_DEVICE_REBUILT;
    });
    EXPECT_THAT(rebuilt.notice().text(), testing::StartsWith("a tick failed; the scene goes on from"));
    peer->readFrames(1);
  }
  // The second time within a simulated second.
  server().device.simulateFailedBatch();
  for (TestPeer* peer : {&left, &right})
    EXPECT_THAT(peer->readToTheEnd().error().text(), HasSubstr("a failed submission is simulated"));
  TestPeer honest(server());
  honest.join("small");
  expectUndisturbed(honest);
  TestPeer again(server());
  again.join("left");
}

TEST_F(SceneFailureTest, CreatedSceneThatFailsIsRefused) {
  START();
  TestPeer honest(server()), maker(server());
  honest.join("small");
  fail("mine", 1);
  EXPECT_THAT(createNamed(maker, "small", "mine").error().text(),
              HasSubstr("the device cannot run it: a failure in a scene is simulated"));
  EXPECT_FALSE(server().scenes.find("mine"));
  expectUndisturbed(honest);
}

}  // namespace
}  // namespace clothstream::hosting
