// SPDX-License-Identifier: MIT
// Who joins a running scene late: what its first frame holds, and how soon it is there. The real server, the
// real client, gRPC over the loopback.
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/grpc/grpc_client.h"
#include "tests/e2e/server_test.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

constexpr int kQualities = 3;
// Promised for 10,000 nodes on a local network. A machine that does much else, with a device made of
// software, may take longer by far.
constexpr auto kPromised = 150ms, kTolerated = 20 * kPromised;

constexpr const char* kScene = R"({
  "name": "late", "simulationRate": 60, "streamRate": 60, "substeps": 4,
  "cloths": [{
    "name": "sheet", "grid": {"rows": 100, "columns": 100, "width": 2, "height": 2}, "mass": 8,
    "structural": {"stiffness": 2}, "shear": {"stiffness": 0.5},
    "pins": [{"columnStep": 99, "lastColumn": 99}]
  }],
  "stream": {"temporalLayers": 2, "qualities": 3}
})";

// The first frame, and one a while later, of a client's thread.
struct Seen {
  std::mutex mutex;
  Clock::time_point first{};
  std::uint64_t frames = 0;
  bool equal = true;  // to what the server holds
  std::uint32_t quality = 0;

  void operator()(cs_client* client, std::uint32_t events) {
    if ((events & CS_EVENT_FRAME) == 0) return;
    const std::lock_guard lock(mutex);
    if (++frames == 1) first = Clock::now();
    cs_statistics statistics;
    cs_get_statistics(client, 0, &statistics);
    equal = equal && statistics.hash_mismatches == 0 && statistics.decode_errors == 0;
    std::uint32_t layers = 0;
    cs_get_operating_point(client, &quality, &layers);
  }
};

class LateJoinTest : public ServerTest {
 protected:
  void SetUp() override {
    std::ofstream(directory_.path() / "late.json") << kScene;
    startServer({"--scene", "late", "--scene-file", (directory_.path() / "late.json").string()});
  }
  std::unique_ptr<GrpcClient> join(std::uint32_t quality, Seen& seen) {
    GrpcClientOptions options;
    options.quality = quality;
    options.joinTimeout = kPatience;
    auto joined = GrpcClient::join(address_, options, std::ref(seen));
    if (!joined) throw std::runtime_error(joined.error().text);
    return std::move(*joined);
  }
  static void waitForFrames(Seen& seen, std::uint64_t count) {
    for (const auto end = Clock::now() + kPatience; Clock::now() < end; std::this_thread::sleep_for(2ms)) {
      const std::lock_guard lock(seen.mutex);
      if (seen.frames >= count) return;
    }
    FAIL() << "no frames came";
  }

  TemporaryDirectory directory_;
};

TEST_F(LateJoinTest, ItsFirstFrameIsWhatTheServerHoldsAndComesSoon) {
  Seen early;
  const auto stays = join(0, early);
  waitForFrames(early, 60);
  for (std::uint32_t quality = 0; quality < kQualities; ++quality) {
    std::vector<Clock::duration> times;
    for (int i = 0; i < 5; ++i) {
      Seen seen;
      const Clock::time_point start = Clock::now();
      const auto late = join(quality, seen);
      waitForFrames(seen, 10);
      const std::lock_guard lock(seen.mutex);
      EXPECT_TRUE(seen.equal);
      EXPECT_GE(seen.quality, quality);
      times.push_back(seen.first - start);
    }
    std::ranges::sort(times);
    const auto ms = [](Clock::duration time) {
      return std::chrono::duration<double, std::milli>(time).count();
    };
    std::printf(
        "quality %u: first correct frame after %.0f ms (median of %zu; least %.0f, most %.0f); promised "
        "%.0f\n",
        quality, ms(times[times.size() / 2]), times.size(), ms(times.front()), ms(times.back()),
        ms(kPromised));
    EXPECT_LT(times[times.size() / 2], kTolerated);
  }
}

}  // namespace
}  // namespace clothstream::e2e
