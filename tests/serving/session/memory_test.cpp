// SPDX-License-Identifier: MIT
// Memory cost of clients that never read.
#include <cstdio>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "server/messages/limits.h"
#include "tests/serving/allocated_bytes.h"
#include "tests/serving/server_test.h"

namespace clothstream::session {
namespace {

using namespace schedule;
using namespace delivery;
using namespace hosting;

using tests::allocatedBytes;
using tests::kMaxBytesAClient;
using tests::TestPeer;

// 10,000 falling nodes with soft springs, so that few substeps suffice.
model::Scene largeScene() {
  model::Scene scene = tests::smallScene("large");
  model::Cloth& cloth = scene.cloths.front();
  cloth.grid.rows = cloth.grid.columns = 100;
  cloth.mass = 10;
  cloth.structural = cloth.shear = cloth.bend = {0.05f, 0};
  cloth.pins.clear();
  scene.substeps = 2;
  // One quality, because the encoders of further qualities would be counted as well.
  scene.stream.qualities = 1;
  return scene;
}

// Sends a message of each kind that makes the server keep data for the client.
void sendAllThereIs(TestPeer& peer, int round) {
  v1::ClientMessage ping;
  ping.mutable_ping()->set_client_time_us(1);
  v1::ClientMessage poses;
  v1::ColliderPoses& moved = *poses.mutable_collider_poses();
  moved.set_client_time_us(static_cast<std::uint64_t>(round) + 1);
  for (std::uint32_t i = 0; i < messages::limits::kMaxParticipantColliders; ++i) {
    v1::ParticipantCollider& collider = *moved.add_colliders();
    collider.set_id(i);
    collider.mutable_pose()->mutable_position()->set_x(100);
    collider.mutable_sphere()->set_radius(0.1f);
  }
  moved.set_server_time_us(microseconds(Clock::now()));
  v1::ClientMessage wind;
  wind.mutable_parameter_change()->mutable_wind()->mutable_value()->set_x(0.001f * static_cast<float>(round));
  v1::ClientMessage question;
  question.mutable_get_scene()->set_name("large");
  for (const v1::ClientMessage& message : {ping, poses, wind, question}) peer.send(message);
}

// Clients that read nothing at all, or nothing after their first frame.
class ClientThatDoesNotRead : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Memory, ClientThatDoesNotRead, testing::Bool(),
                         [](const auto& reads) { return reads.param ? "AnyMore" : "AtAll"; });

TEST_P(ClientThatDoesNotRead, CostsAtMostThePromisedMemory) {
  ServerOptions options;
  options.defaultScene = "large";
  std::unique_ptr<SceneServer> server;
  try {
    server = std::make_unique<SceneServer>(std::vector{largeScene()}, options);
  } catch (const vulkan::DeviceError& error) {
    GTEST_SKIP() << error.what();
  }
  const auto wait = [] { std::this_thread::sleep_for(std::chrono::milliseconds(50)); };  // two ticks
  TestPeer first(*server);
  first.join();  // so that the scene has allocated its memory

  constexpr int kClients = 6, kRounds = 60;
  std::vector<std::unique_ptr<TestPeer>> clients;
  const auto add = [&] {
    TestPeer& client = *clients.emplace_back(std::make_unique<TestPeer>(*server, "does not read"));
    client.acknowledges = false;
    return &client;
  };
  if (GetParam())
    for (int i = 0; i < kClients; ++i) add()->join();
  const double before = allocatedBytes();
  // Each client gets a separate description, because the parameters change between them.
  if (!GetParam())
    for (int i = 0; i < kClients; ++i) {
      TestPeer& client = *add();
      client.hello("large");
      sendAllThereIs(client, 0);
      wait();
    }
  for (int round = 1; round < kRounds; ++round) {
    for (const auto& client : clients) sendAllThereIs(*client, round);
    wait();
  }
  const double each = (allocatedBytes() - before) / kClients;
  std::printf("a client that does not read: %.0f KiB\n", each / 1024);
  EXPECT_LT(each, kMaxBytesAClient);
}

// A mailbox filled to all of its limits takes no more than their sum.
TEST(Memory, MailboxStaysWithinItsLimits) {
  telemetry::SceneMetrics metrics;
  constexpr int kMailboxes = 4;
  std::vector<std::shared_ptr<Mailbox>> mailboxes;
  const double before = allocatedBytes();
  for (int i = 0; i < kMailboxes; ++i) {
    const auto& mailbox = mailboxes.emplace_back(std::make_shared<Mailbox>([] {}));
    mailbox->subscribe(nullptr, {.rate = 72}, metrics);
    const auto message = [](std::size_t bytes) { return std::make_shared<std::vector<std::byte>>(bytes); };
    // Small messages, whose overhead is larger than their bytes.
    while (mailbox->reply(message(8))) {
    }
    for (std::size_t sent = 0; sent < 2 * ControlMessages::kMaxBytes;
         sent += ControlMessages::kMessageOverhead)
      mailbox->announce(message(8));
    for (std::uint64_t tick = 1; tick < 100 + HeldFrames::kMax; ++tick)
      mailbox->deliver({.message = message(HeldFrames::kMaxBytes / HeldFrames::kMax),
                        .tick = tick,
                        .key = tick == 1 || tick % 10 == 0,
                        .referenceTick = tick - 1,
                        .complete = Clock::now()});
  }
  const double each = (allocatedBytes() - before) / kMailboxes;
  std::printf("a full mailbox: %.0f KiB\n", each / 1024);
  EXPECT_LE(each, 2.0 * ControlMessages::kMaxBytes + HeldFrames::kMaxBytes + (64 << 10));
}

}  // namespace
}  // namespace clothstream::session
