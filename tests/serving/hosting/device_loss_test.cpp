// SPDX-License-Identifier: MIT
// Loss of the device in a server with several scenes: each runs again as soon as it is loaded.
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/serving/server_test.h"

namespace clothstream::hosting {
namespace {

using tests::TestPeer;

using testing::HasSubstr;

// Notes the names of scenes in the order in which their simulations were replaced.
class NamesInOrder {
 public:
  void add(const std::string& name) {
    const std::lock_guard lock(mutex_);
    names_.push_back(name);
  }
  std::vector<std::string> names() const {
    const std::lock_guard lock(mutex_);
    return names_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> names_;
};

class NotingJournal : public scene::Journal {
 public:
  NotingJournal(std::string name, std::shared_ptr<NamesInOrder> order)
      : name_(std::move(name)), order_(std::move(order)) {}
  bool active() const override { return false; }
  bool due() const override { return false; }
  void begin(const vulkan::DeviceInfo&, const model::Scene&, const v1::StreamDescription&,
             const simulation::StateSnapshot&, const simulation::StateSnapshot&) override {}
  void ticked(const scene::AppliedTick&) override {}
  void saved(const simulation::StateSnapshot&) override {}
  void restored(std::uint64_t, const simulation::StateSnapshot&) override { order_->add(name_); }
  void end() override {}
  void sent(const delivery::SharedBytes&) override {}
  void joined(std::uint64_t, const std::string&, const std::string&) override {}
  void left(std::uint64_t) override {}

 private:
  const std::string name_;
  const std::shared_ptr<NamesInOrder> order_;
};

class DeviceLossTest : public tests::ServerTest {
 protected:
  DeviceThread& device() { return server().device; }
  // Says hello to the scene, and returns the text of the error that ends the session.
  std::string whyEnded(const std::string& scene) {
    TestPeer peer(server());
    peer.hello(scene);
    return peer.readToTheEnd().error().text();
  }
};

void readUntilRebuilt(TestPeer& peer) {
  const v1::ServerMessage rebuilt = peer.readUntil([](const v1::ServerMessage& message) {
    return message.notice().kind() == v1::NOTICE_KIND_DEVICE_REBUILT;
  });
  EXPECT_THAT(rebuilt.notice().text(), testing::StartsWith("the device was lost; the scene goes on from"));
  peer.readFrames(1);
}

TEST_F(DeviceLossTest, RunsScenesAgainOneByOneDefaultFirst) {
  const auto order = std::make_shared<NamesInOrder>();
  ServerOptions options;
  options.journals = [order](const model::Scene& scene) {
    return std::make_shared<NotingJournal>(scene.name, order);
  };
  std::vector<model::Scene> more;
  for (int i = 0; i < 4; ++i) more.push_back(tests::smallScene(fmt::format("more-{}", i)));
  start(std::move(options), more);
  if (IsSkipped()) return;
  TestPeer first(server());
  first.join("small");
  std::vector<std::unique_ptr<TestPeer>> others;
  for (const char* scene : {"other", "more-0", "more-1", "more-2", "more-3", "more-3"}) {
    others.push_back(std::make_unique<TestPeer>(server()));
    others.back()->join(scene);
  }
  device().simulateDeviceLoss();
  readUntilRebuilt(first);
  for (const auto& peer : others) readUntilRebuilt(*peer);
  const std::vector<std::string> names = order->names();
  ASSERT_EQ(names.size(), 6u);
  EXPECT_EQ(names[0], "small");
  EXPECT_EQ(names[1], "more-3") << "it has the most participants";
  EXPECT_THAT(names, testing::UnorderedElementsAre("small", "other", "more-0", "more-1", "more-2", "more-3"));
  EXPECT_EQ(server().metrics.deviceRebuilds.value(), 1u);
}

TEST_F(DeviceLossTest, AFailureThatBelongsToNoSceneRebuildsNothing) {
  const auto order = std::make_shared<NamesInOrder>();
  ServerOptions options;
  options.journals = [order](const model::Scene& scene) {
    return std::make_shared<NotingJournal>(scene.name, order);
  };
  start(std::move(options));
  if (IsSkipped()) return;
  TestPeer first(server()), second(server());
  first.join("small");
  second.join("other");
  for (int i = 0; i < 3; ++i) {
    device().simulateFailure();
    first.readFrames(2);
    second.readFrames(2);
  }
  EXPECT_THAT(order->names(), testing::IsEmpty());
  EXPECT_EQ(server().metrics.deviceRebuilds.value(), 0u);
}

TEST_F(DeviceLossTest, SceneThatIsLostWhileItLoadsIsGivenUpThenStopped) {
  start();
  if (IsSkipped()) return;
  device().simulateDeviceLossIn("other");
  EXPECT_THAT(whyEnded("other"), HasSubstr("it harms other scenes: the device was lost twice"));
  EXPECT_THAT(whyEnded("other"), HasSubstr("the scene 'other' is stopped because it harms other scenes"));
  EXPECT_EQ(server().metrics.quarantines.value(), 1u);
  TestPeer honest(server());
  honest.join("small");
  honest.readFrames(3);
  EXPECT_EQ(server().metrics.deviceRebuilds.value(), 3u);
}

TEST_F(DeviceLossTest, SceneGivenUpOnceRunsAgainWithItsOwnParameters) {
  start();
  if (IsSkipped()) return;
  TestPeer peer(server());
  peer.join("other");
  v1::ParameterChange change;
  change.mutable_gravity()->mutable_value()->set_y(-5);
  peer.change(change);
  peer.readUntil(v1::ServerMessage::kParameterChanged);
  device().simulateDeviceLossIn("other");
  EXPECT_THAT(peer.readToTheEnd().error().text(),
              HasSubstr("join again to start it with its own parameters"));
  device().simulateDeviceLossIn("");
  TestPeer again(server());
  again.join("other");
  const model::Scene now = server().scenes.find("other")->definition();
  EXPECT_EQ(now.environment.gravity.y(), tests::smallScene().environment.gravity.y());
  EXPECT_EQ(server().metrics.quarantines.value(), 0u);
}

TEST_F(DeviceLossTest, OnlyTheSceneThatLosesTheDeviceIsGivenUp) {
  start();
  if (IsSkipped()) return;
  TestPeer honest(server()), peer(server());
  honest.join("small");
  peer.join("other");
  device().simulateDeviceLossIn("other");
  EXPECT_THAT(peer.readToTheEnd().error().text(), HasSubstr("the device was lost twice"));
  EXPECT_THAT(whyEnded("other"), HasSubstr("is stopped because it harms other scenes"));
  honest.readFrames(3);
  EXPECT_FALSE(honest.finished());
}

TEST_F(DeviceLossTest, RefusesACreatedSceneThatLosesTheDeviceWhileItLoads) {
  start();
  if (IsSkipped()) return;
  device().simulateDeviceLossIn("mine");
  TestPeer peer(server());
  v1::ClientMessage message;
  message.set_request_id(7);
  message.mutable_create_scene()->set_named("small");
  message.mutable_create_scene()->set_name("mine");
  peer.send(message);
  const v1::ServerMessage answer =
      peer.readUntil([](const v1::ServerMessage& each) { return each.request_id() == 7; });
  EXPECT_THAT(answer.error().text(),
              HasSubstr("the device cannot run it: the device was lost while the scene was being loaded"));
  peer.join("small");
  EXPECT_EQ(server().metrics.deviceRebuilds.value(), 1u);
  EXPECT_EQ(server().unaryCalls.listScenes().scenes_size(), 2);
}

}  // namespace
}  // namespace clothstream::hosting
