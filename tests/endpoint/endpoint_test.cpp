// SPDX-License-Identifier: MIT
// Tests of both endpoints with well-behaved and misbehaving clients.
#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/endpoint/small_server.h"
#include "tests/endpoint/transport.h"
#include "tests/serving/allocated_bytes.h"

namespace clothstream::tests {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;
using Clock = std::chrono::steady_clock;

class Endpoint : public SmallServer, public ::testing::WithParamInterface<TransportKind> {
 protected:
  void SetUp() override {
    SmallServer::SetUp();
    if (!IsSkipped()) transport_->open(server());
  }
  void TearDown() override {
    transport_->close();
    SmallServer::TearDown();
  }
  Joined join(const std::string& scene = "") { return Joined(transport_->connect(), scene); }

  const std::unique_ptr<Transport> transport_ = GetParam().make();
};

INSTANTIATE_TEST_SUITE_P(Transports, Endpoint, ::testing::ValuesIn(transportKinds()),
                         [](const auto& kind) { return std::string(kind.param.name); });

TEST_P(Endpoint, StreamsDecodableFrames) {
  Joined client = join();
  EXPECT_EQ(client.viewer.welcome.scene(), "small");
  EXPECT_EQ(client.viewer.description.cloths(0).vertex_count(), 64U);
  const std::uint64_t first = client.viewer.tick();
  EXPECT_TRUE(client.see(10));
  EXPECT_GE(client.viewer.tick(), first + 10);
  EXPECT_TRUE(client.viewer.errors.empty());
}

TEST_P(Endpoint, AnswersPings) {
  Joined client = join();
  client.client->send(ping());
  EXPECT_TRUE(client.seeUntil([&] { return client.viewer.pongs == 1; }));
}

TEST_P(Endpoint, ListsScenesBeforeHello) {
  const auto client = transport_->connect();
  v1::ClientMessage question;
  question.set_request_id(5);
  question.mutable_list_scenes();
  client->send(question.SerializeAsString());
  Viewer viewer;
  ASSERT_TRUE(client->watch(viewer, [&] { return viewer.last.has_list_scenes(); }));
  EXPECT_EQ(viewer.last.request_id(), 5U);
  EXPECT_EQ(viewer.last.list_scenes().scenes_size(), 3);
}

TEST_P(Endpoint, NamesUnknownSceneInErrorAndAtEndOfStream) {
  const auto client = transport_->connect();
  client->send(hello("nowhere"));
  Viewer viewer;
  EXPECT_FALSE(client->watch(viewer, [] { return false; }));
  ASSERT_EQ(viewer.errors.size(), 1U) << "the error comes before the end";
  EXPECT_EQ(viewer.errors[0].code(), v1::ERROR_CODE_NOT_FOUND);
  EXPECT_THAT(viewer.errors[0].text(), HasSubstr("nowhere"));
  const StreamEnd end = client->end();
  EXPECT_EQ(end.code, transport_->codeOf(EndCause::unknownScene));
  EXPECT_THAT(end.text, HasSubstr("nowhere"));
  EXPECT_EQ(end.text, viewer.errors[0].text().substr(0, transport_->maxEndText()));
}

TEST_P(Endpoint, EndsStreamAfterMessageBeforeHello) {
  const auto client = transport_->connect();
  client->send(colliderPose(0.25f));
  Viewer viewer;
  EXPECT_FALSE(client->watch(viewer, [] { return false; }));
  EXPECT_EQ(client->end().code, transport_->codeOf(EndCause::outOfOrder));
}

TEST_P(Endpoint, ReportsGarbageToItsSenderOnly) {
  Joined other = join(), client = join();
  ASSERT_TRUE(client.client->send(garbage(500)));
  EXPECT_TRUE(client.seeUntil([&] { return !client.viewer.errors.empty(); }));
  EXPECT_EQ(client.viewer.errors[0].code(), v1::ERROR_CODE_MALFORMED_MESSAGE);
  EXPECT_TRUE(other.see(5));
  EXPECT_TRUE(other.viewer.errors.empty());
}

TEST_P(Endpoint, EndsStreamAfterRepeatedGarbage) {
  Joined other = join(), client = join();
  for (int i = 0; i < 100 && client.client->send(garbage(50)); ++i) {
  }
  EXPECT_EQ(client.seeEnd().code, transport_->codeOf(EndCause::malformed));
  EXPECT_TRUE(other.see(5));
}

TEST_P(Endpoint, EndsStreamAfterTooLargeMessage) {
  Joined other = join(), client = join();
  client.client->send(garbage(64 * 1024 + 1));
  EXPECT_EQ(client.seeEnd().code, transport_->codeOf(EndCause::tooLarge));
  EXPECT_TRUE(other.see(5));
}

TEST_P(Endpoint, ShowsColliderToOthersUntilItsOwnerDisconnects) {
  Joined watcher = join(), owner = join();
  const std::uint64_t id = owner.viewer.welcome.participant_id();
  owner.client->send(colliderPose(0.25f));
  ASSERT_TRUE(watcher.seeUntil([&] { return watcher.viewer.colliderOf(id).has_value(); }));
  EXPECT_FLOAT_EQ(watcher.viewer.colliderOf(id)->position().x(), 0.25f);
  owner.client->disconnect();
  EXPECT_TRUE(watcher.seeUntil([&] { return !watcher.viewer.colliderOf(id).has_value(); }));
}

TEST_P(Endpoint, RemovesColliderOfClientThatLeaves) {
  Joined watcher = join(), owner = join();
  const std::uint64_t id = owner.viewer.welcome.participant_id();
  owner.client->send(colliderPose(0.25f));
  ASSERT_TRUE(watcher.seeUntil([&] { return watcher.viewer.colliderOf(id).has_value(); }));
  owner.client->leave();
  while (owner.client->receive()) {
  }
  EXPECT_EQ(owner.client->end().code, transport_->codeOf(EndCause::left));
  EXPECT_TRUE(watcher.seeUntil([&] { return !watcher.viewer.colliderOf(id).has_value(); }));
}

// Ends a stream with `end`, and returns what the watcher learns about that participant.
v1::Presence presenceAfter(Joined& watcher, Joined client, const std::function<void(Client&)>& end) {
  end(*client.client);
  EXPECT_TRUE(watcher.seeUntil([&] {
    const v1::Presence& presence = watcher.viewer.last.presence();
    return presence.participant().id() == client.viewer.welcome.participant_id() &&
           (presence.kind() == v1::PRESENCE_KIND_LEFT || presence.kind() == v1::PRESENCE_KIND_DISCONNECTED);
  }));
  return watcher.viewer.last.presence();
}

// Only a goodbye makes a participant leave. After a lost connection the participant may resume.
TEST_P(Endpoint, DistinguishesGoodbyeFromLostConnection) {
  Joined watcher = join();
  EXPECT_EQ(presenceAfter(watcher, join(), [](Client& client) { client.leave(); }).reason(),
            v1::LEAVE_REASON_LEFT);
  EXPECT_EQ(presenceAfter(watcher, join(), [](Client& client) { client.disconnect(); }).kind(),
            v1::PRESENCE_KIND_DISCONNECTED);
}

// The slow client reads nothing for 60 ticks. Then it gets the few frames that were unacknowledged, and fresh
// ones after them.
TEST_P(Endpoint, SkipsFramesForSlowReaderWithoutDelayingOthers) {
  Joined other = join(), slow = join();
  const std::uint64_t stoppedAt = slow.viewer.tick();
  for (std::uint64_t ticks = 15; ticks <= 60; ticks += 15) {
    ASSERT_TRUE(other.seeUntil([&] { return other.viewer.tick() >= stoppedAt + ticks; }));
    transport_->keepAlive(*slow.client);
  }
  const std::uint64_t now = other.viewer.tick();
  std::uint64_t stale = 0;
  EXPECT_TRUE(slow.seeUntil([&] {
    if (slow.viewer.last.has_frame() && slow.viewer.tick() < now) ++stale;
    return slow.viewer.tick() >= now;
  }));
  EXPECT_LE(stale, 6U);  // two, and one for each 33 ms of round-trip time on a busy machine
  EXPECT_TRUE(slow.see(10));
}

// A write to a client that does not read never completes, so the endpoint must cancel it.
TEST_P(Endpoint, CutsOffMisbehavingClientThatDoesNotRead) {
  transport_->open(server(), {.maxConnections = 2});
  const auto client = transport_->connect(true);
  client->send(hello("large"));
  ASSERT_TRUE(client->receive().has_value());
  Joined other = join();
  ASSERT_TRUE(other.see(10));  // by now the endpoint is writing the description
  for (int i = 0; i < 100 && client->send(garbage(50)); ++i) {
  }
  const auto start = Clock::now();
  // Slowly, since the endpoint limits new connections per second.
  while (!transport_->hasRoom() && Clock::now() - start < transport_->cutOffTime())
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_LT(Clock::now() - start, transport_->cutOffTime());
  EXPECT_TRUE(other.see(5));
}

TEST_P(Endpoint, ServesOthersWhileManyClientsComeAndGo) {
  Joined watcher = join();
  for (int round = 0; round < 10; ++round) {
    std::vector<Joined> clients;
    for (int i = 0; i < 5; ++i) clients.push_back(join(i % 2 ? "other" : ""));
    for (const Joined& client : clients) client.client->disconnect();
    EXPECT_TRUE(watcher.see(1));
  }
  EXPECT_TRUE(watcher.see(5));
  EXPECT_TRUE(watcher.viewer.errors.empty());
}

// The measured memory includes the client's part, since client and server share this process.
TEST_P(Endpoint, BoundsMemoryOfClientThatDoesNotRead) {
  constexpr int kClients = 4, kRounds = 60;
  const Joined first = join("large");  // so that the scene already holds its memory
  const double before = allocatedBytes();
  std::vector<std::unique_ptr<Client>> clients;
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(transport_->connect());
    clients.back()->send(hello("large"));
  }
  for (int round = 0; round < kRounds; ++round) {
    for (const auto& client : clients) {
      client->send(ping());
      client->send(colliderPose(0.01f * static_cast<float>(round)));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(35));  // a tick
  }
  const double bytes = (allocatedBytes() - before) / kClients;
  std::printf("a client that does not read: %.0f KiB\n", bytes / 1024);
  EXPECT_LT(bytes, kMaxBytesAClient);
}

TEST_P(Endpoint, SuggestsPortOptionWhenPortIsInUse) {
  const std::unique_ptr<Transport> second = GetParam().make();
  EXPECT_THAT([&] { second->open(server(), {.port = transport_->port()}); },
              ThrowsMessage<std::runtime_error>("port " + std::to_string(transport_->port()) +
                                                " on 127.0.0.1 is already in use: choose another with " +
                                                transport_->portOption()));
}

TEST_P(Endpoint, NamesHostThatIsNotThisMachine) {
  EXPECT_THAT(
      [&] {
        transport_->open(server(), {.host = "192.0.2.1"});  // RFC 5737: reserved for documentation
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("cannot listen on port 0 of 192.0.2.1: ")));
}

TEST_P(Endpoint, EndsEveryStreamWhenItCloses) {
  Joined first = join(), second = join();
  std::thread closing([&] { transport_->close(); });
  EXPECT_EQ(first.seeEnd().code, transport_->codeOf(EndCause::serverStops));
  EXPECT_EQ(second.seeEnd().code, transport_->codeOf(EndCause::serverStops));
  closing.join();
}

TEST_P(Endpoint, AnnouncesThatServerStops) {
  Joined client = join();
  server().stop();
  EXPECT_EQ(client.seeEnd().code, transport_->codeOf(EndCause::serverStops));
  ASSERT_FALSE(client.viewer.notices.empty());
  EXPECT_EQ(client.viewer.notices.back().kind(), v1::NOTICE_KIND_SERVER_STOPPING);
}

}  // namespace
}  // namespace clothstream::tests
