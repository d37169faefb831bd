// SPDX-License-Identifier: MIT
// A client that joins a running scene: its first frame is correct and comes soon. Real server and client,
// gRPC over the loopback.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/grpc/grpc_client.h"
#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kQualities = 3;
// Promise for 10,000 nodes on a local network: 150 ms, which are 9 ticks. The ticks count from the newest
// frame of another client when it learns that the client has joined.
constexpr std::uint64_t kPromisedTicks = 9;

constexpr const char* kScene = R"({
  "name": "late", "simulationRate": 60, "streamRate": 60, "substeps": 4,
  "cloths": [{
    "name": "sheet", "grid": {"rows": 100, "columns": 100, "width": 2, "height": 2}, "mass": 8,
    "structural": {"stiffness": 2}, "shear": {"stiffness": 0.5},
    "pins": [{"columnStep": 99, "lastColumn": 99}]
  }],
  "stream": {"qualities": 3}
})";

// Events that a client has received.
struct Seen {
  std::mutex mutex;
  std::uint64_t frames = 0, firstTick = 0, newestTick = 0;
  std::uint64_t keyFramesAtFirst = 0;  // decoded key frames when the first frame arrived
  std::uint64_t joins = 0,
                tickAtJoin = 0;  // other clients that joined; newest tick when the last of them joined
  bool matches = true;           // every frame equals the server's reconstruction
  std::uint32_t quality = 0;
  Clock::time_point first{};

  void operator()(cs_client* client, std::uint32_t events) {
    const std::lock_guard lock(mutex);
    if ((events & CS_EVENT_PRESENCE) != 0) {
      cs_presence presence;
      cs_get_presence(client, &presence, nullptr);
      if (presence.kind == CS_PRESENCE_JOINED) {
        ++joins;
        tickAtJoin = newestTick;
      }
    }
    if ((events & CS_EVENT_FRAME) == 0) return;
    cs_statistics statistics;
    cs_get_statistics(client, 0, &statistics);
    newestTick = statistics.tick;
    if (++frames == 1) {
      first = Clock::now();
      firstTick = statistics.tick;
      keyFramesAtFirst = statistics.key_frames;
    }
    matches = matches && statistics.hash_mismatches == 0 && statistics.decode_errors == 0;
    cs_get_quality(client, &quality);
  }
};

class LateJoin : public RunningServer {
 protected:
  void SetUp() override {
    std::ofstream(directory_.path() / "late.json") << kScene;
    startServer({"--scene", "late", "--scene-file", (directory_.path() / "late.json").string()});
  }
  std::unique_ptr<NativeClient> join(std::uint32_t quality, Seen& seen) {
    NativeClientOptions options;
    options.quality = quality;
    options.joinTimeout = kPatience;
    auto joined = joinByGrpc(address_, options, std::ref(seen));
    if (!joined) throw std::runtime_error(joined.error().text);
    return std::move(*joined);
  }
  static void waitForFrames(Seen& seen, std::uint64_t count) {
    ASSERT_TRUE(eventually([&] {
      const std::lock_guard lock(seen.mutex);
      return seen.frames >= count;
    })) << "too few frames arrived";
  }

  TemporaryDirectory directory_;
};

TEST_F(LateJoin, DecodesFirstFrameWithinPromisedTicks) {
  Seen early;
  const auto watcher = join(0, early);
  ASSERT_NO_FATAL_FAILURE(waitForFrames(early, 60));
  std::uint64_t joins = 0;
  for (std::uint32_t quality = 0; quality < kQualities; ++quality) {
    std::vector<std::uint64_t> ticks;
    std::vector<Clock::duration> times;
    for (int i = 0; i < 5; ++i) {
      Seen seen;
      const Clock::time_point start = Clock::now();
      const auto late = join(quality, seen);
      ASSERT_NO_FATAL_FAILURE(waitForFrames(seen, 10));
      ++joins;
      ASSERT_TRUE(eventually([&] {
        const std::lock_guard lock(early.mutex);
        return early.joins >= joins;
      }));
      const std::scoped_lock lock(early.mutex, seen.mutex);
      EXPECT_TRUE(seen.matches);
      EXPECT_GE(seen.quality, quality);
      EXPECT_EQ(seen.keyFramesAtFirst, 1u) << "the first frame is a key frame";
      ticks.push_back(seen.firstTick - std::min(early.tickAtJoin, seen.firstTick));
      times.push_back(seen.first - start);
    }
    std::ranges::sort(ticks);
    std::ranges::sort(times);
    const auto ms = [](Clock::duration time) {
      return std::chrono::duration<double, std::milli>(time).count();
    };
    std::printf("quality %u: first frame after %lu ticks (median of %zu; most %lu), %.0f ms (most %.0f)\n",
                quality, ticks[ticks.size() / 2], ticks.size(), ticks.back(), ms(times[times.size() / 2]),
                ms(times.back()));
    EXPECT_LE(ticks[ticks.size() / 2], kPromisedTicks);
  }
}

}  // namespace
}  // namespace clothstream::e2e
