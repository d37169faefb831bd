// SPDX-License-Identifier: MIT
// The native client over a link that is cut and restored, against the real clothstream-server.
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/grpc/grpc_client.h"
#include "clients/websocket/web_socket_transport.h"
#include "tests/e2e/link.h"
#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

// Most attempts that may fail after the link is restored: one that was under way, and on a busy machine a few
// that take longer than the client waits.
constexpr std::uint64_t kMaxFailedAttempts = 4;
// Most ticks from the server's notice that a participant has returned to that participant's first frame: 0.25
// s of the scene.
constexpr std::uint64_t kMaxTicksUntilFrame = 30;

// Events that a client has received. A cut is a lost connection or a failed attempt to reconnect.
struct Seen {
  std::atomic<std::uint64_t> id{0}, frames{0}, returns{0}, resumed{0}, cuts{0}, participants{0};
  std::atomic<std::uint64_t> lastPresence{0};  // kind of the newest presence event
  std::atomic<std::uint64_t> tick{0}, tickAtReturnOfOther{0}, tickAfterReturn{0};
  std::atomic<std::uint64_t> keyFrames{0}, keyFramesAfterReturn{0};
  std::atomic<Clock::rep> firstFrameAfterReturn{0};

  void operator()(cs_client* client, std::uint32_t events) {
    if (events == 0) ++cuts;
    if ((events & CS_EVENT_RETURNED) != 0) {
      resumed = static_cast<std::uint64_t>(cs_resumed(client));
      firstFrameAfterReturn = 0;
      ++returns;
    }
    if ((events & CS_EVENT_PRESENCE) != 0) {
      cs_presence presence;
      cs_get_presence(client, &presence, nullptr);
      if (presence.kind == CS_PRESENCE_RETURNED) tickAtReturnOfOther = tick.load();
      lastPresence = presence.kind;
    }
    participants = cs_participant_count(client);
    id = cs_participant_id(client);
    if ((events & CS_EVENT_FRAME) == 0) return;
    cs_statistics statistics;
    cs_get_statistics(client, NativeClient::nowUs(), &statistics);
    tick = statistics.tick;
    if (firstFrameAfterReturn == 0) {
      tickAfterReturn = statistics.tick;
      keyFramesAfterReturn = statistics.key_frames - keyFrames;
      firstFrameAfterReturn = Clock::now().time_since_epoch().count();
    }
    keyFrames = statistics.key_frames;
    ++frames;
  }
};

class Reconnect : public RunningServer {
 protected:
  void SetUp() override { startServer(); }

  std::unique_ptr<NativeClient> join(const std::string& address, const std::string& name, Seen& seen) const {
    NativeClientOptions options;
    options.displayName = name;
    auto joined = NativeClient::join(
        address, endpoint_ == Endpoint::grpc ? makeGrpcTransport(address) : makeWebSocketTransport(address),
        options, std::ref(seen));
    if (!joined) throw std::runtime_error(joined.error().text);
    return std::move(*joined);
  }
  static std::string through(const Link& link) { return "127.0.0.1:" + std::to_string(link.port()); }
  // Restores the link. The client must resume as the same participant, after few attempts and with a key
  // frame.
  static void restore(Link& link, const Seen& seen, const char* what, std::chrono::milliseconds outage) {
    const std::uint64_t id = seen.id, returns = seen.returns, cuts = seen.cuts;
    const auto restored = Clock::now();
    link.restore();
    ASSERT_TRUE(eventually([&] { return seen.returns > returns && seen.firstFrameAfterReturn != 0; }));
    const auto took = Clock::time_point(Clock::duration(seen.firstFrameAfterReturn)) - restored;
    const std::uint64_t failed = seen.cuts - cuts;
    std::printf(
        "%s for %lld ms: the first frame came %lld ms after the link was restored, after %lu failed "
        "attempts\n",
        what, static_cast<long long>(outage.count()),
        static_cast<long long>(std::chrono::duration_cast<std::chrono::milliseconds>(took).count()), failed);
    EXPECT_LE(failed, kMaxFailedAttempts);
    EXPECT_EQ(seen.keyFramesAfterReturn, 1u) << "the first frame is a key frame";
    EXPECT_EQ(seen.resumed, 1u);
    EXPECT_EQ(seen.id, id);
  }
  // Address of the endpoint that join() uses.
  const std::string& served() const { return endpoint_ == Endpoint::grpc ? address_ : web_; }

  Endpoint endpoint_ = Endpoint::grpc;
};

class ReconnectOver : public Reconnect, public ::testing::WithParamInterface<Endpoint> {
 protected:
  ReconnectOver() { endpoint_ = GetParam(); }
};

INSTANTIATE_TEST_SUITE_P(Transports, ReconnectOver, ::testing::Values(Endpoint::grpc, Endpoint::web),
                         [](const auto& endpoint) {
                           return std::string(endpoint.param == Endpoint::grpc ? "Grpc" : "WebSocket");
                         });

TEST_P(ReconnectOver, ResumesAsTheSameParticipant) {
  Link link(portIn(served()));
  Seen seen, watcherSeen;
  const auto watcher = join(served(), "Ben", watcherSeen);
  const auto client = join(through(link), "Ada", seen);
  const cs_own_collider sphere{.shape = CS_SHAPE_SPHERE,
                               .position = {0.4f, 1.7f, 0.3f},
                               .orientation = {},
                               .radius = 0.1f,
                               .length = 0,
                               .size = {},
                               .top_radius = 0};
  client->visit([&](cs_client* core) { cs_set_colliders(core, &sphere, 1, NativeClient::nowUs()); });
  const auto watcherSeesCollider = [&] {
    bool sees = false;
    watcher->visit([&](cs_client* core) {
      cs_collider collider;
      for (std::uint32_t i = 0; cs_get_collider(core, i, &collider) != 0; ++i)
        sees |= collider.participant_id == seen.id;
    });
    return sees;
  };
  ASSERT_TRUE(eventually(watcherSeesCollider));
  for (const auto outage : {100ms, 1000ms, 5000ms}) {
    link.cut();
    ASSERT_TRUE(eventually([&] { return watcherSeen.lastPresence == CS_PRESENCE_DISCONNECTED; }));
    std::this_thread::sleep_for(outage);
    if (outage > 3s) {
      EXPECT_TRUE(eventually([&] { return !watcherSeesCollider(); }));
    }
    EXPECT_EQ(watcherSeen.participants, 2u);
    ASSERT_NO_FATAL_FAILURE(restore(link, seen, "cut off", outage));
    ASSERT_TRUE(eventually([&] { return watcherSeen.lastPresence == CS_PRESENCE_RETURNED; }));
    EXPECT_TRUE(eventually(watcherSeesCollider));
    const std::uint64_t until = seen.tickAfterReturn, from = watcherSeen.tickAtReturnOfOther;
    std::printf("the first frame is %ld ticks after the return\n", static_cast<long>(until - from));
    EXPECT_LE(until, from + kMaxTicksUntilFrame);
  }
  EXPECT_FALSE(client->ended());
  client->visit([](cs_client* core) {
    cs_statistics statistics;
    cs_get_statistics(core, NativeClient::nowUs(), &statistics);
    EXPECT_EQ(statistics.hash_mismatches, 0u);
    EXPECT_GT(statistics.dropped, 0u);
  });
}

// Like a radio link out of reach: connections are neither refused nor accepted.
TEST_P(ReconnectOver, ReconnectsAfterLinkThatSwallowedEverything) {
  Link link(portIn(served()));
  Seen seen;
  const auto client = join(through(link), "Ada", seen);
  for (const auto outage : {1000ms, 3000ms, 5000ms}) {
    const std::uint64_t returns = seen.returns, cuts = seen.cuts;
    link.swallow();
    ASSERT_TRUE(eventually([&] { return seen.cuts > cuts; }));
    std::this_thread::sleep_for(outage);
    EXPECT_EQ(seen.returns, returns);
    ASSERT_NO_FATAL_FAILURE(restore(link, seen, "swallowed", outage));
  }
  EXPECT_FALSE(client->ended());
}

TEST_F(Reconnect, JoinsRestartedServerAsNewParticipant) {
  Seen seen;
  const std::string sameAddress = address_;
  const auto client = join(address_, "Ada", seen);
  stopServer();
  startServer(kSmallScene, std::to_string(portIn(address_)));
  ASSERT_EQ(address_, sameAddress);
  ASSERT_TRUE(eventually([&] { return seen.returns == 1 && seen.firstFrameAfterReturn != 0; }));
  EXPECT_EQ(seen.resumed, 0u);
  EXPECT_FALSE(client->ended());
}

TEST_F(Reconnect, EndsAtOnceWithoutReconnectTime) {
  Link link(portIn(address_));
  Seen seen;
  NativeClientOptions options;
  options.reconnectFor = 0ms;
  auto joined = joinByGrpc(through(link), options, std::ref(seen));
  ASSERT_TRUE(joined.has_value()) << joined.error().text;
  link.cut();
  ASSERT_TRUE(eventually([&] { return (*joined)->ended().has_value(); }));
  EXPECT_EQ((*joined)->ended()->kind, Failure::Kind::lost);
  EXPECT_EQ(seen.cuts, 0u);
}

TEST_F(Reconnect, EndsAfterReconnectTime) {
  Link link(portIn(address_));
  Seen seen;
  NativeClientOptions options;
  options.reconnectFor = 500ms;
  auto joined = joinByGrpc(through(link), options, std::ref(seen));
  ASSERT_TRUE(joined.has_value()) << joined.error().text;
  link.cut();
  ASSERT_TRUE(eventually([&] { return (*joined)->ended().has_value(); }));
  EXPECT_THAT((*joined)->ended()->text, HasSubstr("could not reconnect within 0.5 s"));
  EXPECT_GE(seen.cuts, 1u);
}

TEST_P(ReconnectOver, LeavesAtOnceWhenDestroyed) {
  Seen seen, watcherSeen;
  const auto watcher = join(served(), "Ben", watcherSeen);
  auto client = join(served(), "Ada", seen);
  ASSERT_TRUE(eventually([&] { return watcherSeen.participants == 2; }));
  client.reset();
  ASSERT_TRUE(eventually([&] { return watcherSeen.participants == 1; }));
  EXPECT_EQ(watcherSeen.lastPresence, static_cast<std::uint64_t>(CS_PRESENCE_LEFT));
}

TEST_F(Reconnect, ProgramNamesParticipantsAndReconnects) {
  Link link(portIn(address_));
  Seen seen;
  const auto watcher = join(address_, "Ben", seen);
  Process program(
      {CLOTHSTREAM, "join", through(link), "--name", "Ada", "--role", "viewer", "--hash", "--report"});
  // A client reconnects only after it has joined; the first report shows that it has.
  ASSERT_TRUE(program.waitForOutput("left", kPatience)) << program.errors();
  link.cut();
  ASSERT_TRUE(eventually([&] { return seen.lastPresence == CS_PRESENCE_DISCONNECTED; }));
  link.restore();
  ASSERT_TRUE(eventually([&] { return seen.lastPresence == CS_PRESENCE_RETURNED; }));
  const auto late = [&] {
    Seen other;
    return join(address_, "Cy", other) != nullptr;
  }();
  EXPECT_TRUE(late);
  program.signal(SIGINT);
  EXPECT_EQ(program.waitForEnd(kPatience), 0) << program.errors();
  for (const char* line : {"joined as viewer", "Ben is here as owner", "the connection is lost",
                           "reconnected as the same participant", "Cy joined as participant"})
    EXPECT_THAT(program.errors(), HasSubstr(line));
}

TEST_F(Reconnect, RecordingContinuesAndCountsLostFrames) {
  const TemporaryDirectory directory;
  const std::filesystem::path file = directory.path() / "cut.mcap";
  Link link(portIn(address_));
  Seen seen;
  const auto watcher = join(address_, "Ben", seen);
  Process program({CLOTHSTREAM, "record", "small", "-o", file, "--server", through(link)});
  ASSERT_TRUE(eventually([&] { return seen.participants == 2; })) << program.errors();
  std::this_thread::sleep_for(500ms);
  link.cut();
  ASSERT_TRUE(eventually([&] { return seen.lastPresence == CS_PRESENCE_DISCONNECTED; }));
  const std::uint64_t frames = seen.frames;
  ASSERT_TRUE(eventually([&] { return seen.frames >= frames + 5; })) << "frames that the program misses";
  link.restore();
  ASSERT_TRUE(eventually([&] { return seen.lastPresence == CS_PRESENCE_RETURNED; }));
  std::this_thread::sleep_for(500ms);
  program.signal(SIGINT);
  EXPECT_EQ(program.waitForEnd(kPatience), 0) << program.errors();
  EXPECT_THAT(program.errors(), HasSubstr("reconnected; the recording continues"));
  EXPECT_THAT(program.output(), ::testing::Not(HasSubstr("; 0 frames were lost")));
  Process info({CLOTHSTREAM, "info", file});
  EXPECT_EQ(info.waitForEnd(kPatience), 0) << info.output() << info.errors();
}

TEST_F(Reconnect, RecordingEndsWhenServerRestarts) {
  const TemporaryDirectory directory;
  const std::filesystem::path file = directory.path() / "ended.mcap";
  Process program({CLOTHSTREAM, "record", "small", "-o", file, "--server", address_});
  const auto hasFrames = [&] {
    return std::filesystem::exists(file) && std::filesystem::file_size(file) > 2000;
  };
  ASSERT_TRUE(eventually(hasFrames));
  const std::string old = std::to_string(portIn(address_));
  stopServer();
  startServer(kSmallScene, old);
  EXPECT_EQ(program.waitForEnd(kPatience), 5);
  EXPECT_THAT(program.errors(), HasSubstr("the recording ends there"));
  Process info({CLOTHSTREAM, "info", file});
  EXPECT_EQ(info.waitForEnd(kPatience), 0) << info.output() << info.errors();
}

}  // namespace
}  // namespace clothstream::e2e
