// SPDX-License-Identifier: MIT
// The time of day jumps while clothstream-server streams and records. libfaketime simulates the jumps.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/grpc/grpc_client.h"
#include "proto/recording/recording_reader.h"
#include "tests/e2e/running_server.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::e2e {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using Clock = std::chrono::steady_clock;

// Distinguishes a jump of an hour from delays of a busy machine.
constexpr std::chrono::seconds kThreshold = 30min;
// Longest gap between two frames. A gap of 30 s would end the stream.
constexpr std::chrono::seconds kLongestGap = 10s;

// Events that a client has received.
struct Watcher {
  void operator()(cs_client* client, std::uint32_t events) {
    const std::lock_guard lock(mutex);
    cuts += events == 0;
    if ((events & CS_EVENT_FRAME) == 0) return;
    cs_statistics now;
    cs_get_statistics(client, NativeClient::nowUs(), &now);
    stepsBack += now.tick <= tick;
    tick = now.tick;
    wrong = now.hash_mismatches + now.decode_errors;
    const Clock::time_point arrival = Clock::now();
    if (frames++ > 0) longestGap = std::max(longestGap, arrival - last);
    last = arrival;
  }
  std::uint64_t framesNow() {
    const std::lock_guard lock(mutex);
    return frames;
  }

  std::mutex mutex;
  std::uint64_t frames = 0, tick = 0, wrong = 0;
  int cuts = 0, stepsBack = 0;
  Clock::time_point last{};
  Clock::duration longestGap{};
};

class ClockJump : public RunningServer {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(CLOTHSTREAM_FAKETIME))
      GTEST_SKIP() << "libfaketime is not installed (Debian's package faketime)";
    jump("+0");
    setenv("LD_PRELOAD", CLOTHSTREAM_FAKETIME, 1);
    setenv("FAKETIME_TIMESTAMP_FILE", file().c_str(), 1);
    setenv("FAKETIME_CACHE_DURATION", "1", 1);  // s
    setenv("FAKETIME_DONT_FAKE_MONOTONIC", "1", 1);
    Arguments options = kSmallScene;
    options.insert(options.end(), {"--scene-file", "tests/e2e/small_with_normals.json", "--recordings",
                                   (directory_.path() / "recordings").string()});
    startServer(options);
    for (const char* name :
         {"LD_PRELOAD", "FAKETIME_TIMESTAMP_FILE", "FAKETIME_CACHE_DURATION", "FAKETIME_DONT_FAKE_MONOTONIC"})
      unsetenv(name);
  }

  void jump(const char* offset) {
    std::ofstream(file().string() + ".draft") << offset;
    std::filesystem::rename(file().string() + ".draft", file());
  }
  std::string ask(Arguments command, int code = 0) const {
    command.insert(command.begin(), CLOTHSTREAM);
    command.insert(command.end(), {"--server", address_});
    Process process(command);
    EXPECT_EQ(process.waitForEnd(kPatience), code) << process.errors();
    return process.output();
  }
  // Returns how far the server's clock is ahead, from the name that the server chooses for a recording. The
  // recording itself fails, because the scene has no participants.
  std::chrono::seconds ahead() const {
    const std::string name = ask({"start-recording", "small_with_normals"});
    ask({"stop-recording", "small_with_normals"}, 4);
    std::tm time{};
    const std::size_t stamp = name.find("-2");
    EXPECT_TRUE(stamp != std::string::npos && strptime(name.c_str() + stamp, "-%Y%m%dT%H%M%SZ", &time))
        << name;
    return std::chrono::seconds(timegm(&time) - std::time(nullptr));
  }
  std::filesystem::path recordings() const { return directory_.path() / "recordings"; }

 private:
  std::filesystem::path file() const { return directory_.path() / "offset"; }
  TemporaryDirectory directory_;
};

TEST_F(ClockJump, DoesNotAffectStreamOrRecording) {
  Watcher watcher;
  auto client =
      joinByGrpc(address_, {}, [&](cs_client* joined, std::uint32_t events) { watcher(joined, events); });
  ASSERT_TRUE(client.has_value()) << client.error().text;
  const auto seesMore = [&](std::uint64_t count) {
    return eventually([&, from = watcher.framesNow()] { return watcher.framesNow() >= from + count; });
  };
  const Clock::time_point began = Clock::now();
  ask({"start-recording", "small", "--name", "jumps"});
  ASSERT_TRUE(seesMore(60));
  jump("+1h");
  ASSERT_TRUE(eventually([&] { return ahead() > kThreshold; }));
  ASSERT_TRUE(seesMore(60));
  jump("-1h");
  ASSERT_TRUE(eventually([&] { return ahead() < -kThreshold; }));
  ASSERT_TRUE(seesMore(60));
  jump("+0");
  ASSERT_TRUE(eventually([&] { return std::chrono::abs(ahead()) < kThreshold; }));
  ASSERT_TRUE(seesMore(60));
  ask({"stop-recording", "small"});
  const std::chrono::duration<double> took = Clock::now() - began;
  client->reset();

  EXPECT_EQ(watcher.cuts, 0);
  EXPECT_EQ(watcher.stepsBack, 0);
  EXPECT_EQ(watcher.wrong, 0u);
  EXPECT_LT(watcher.longestGap, kLongestGap);
  std::printf("three jumps of the clock: frames at most %.0f ms apart\n",
              std::chrono::duration<double, std::milli>(watcher.longestGap).count());

  const std::string path = (recordings() / "jumps.mcap").string();
  auto reader = recording::RecordingReader::open(path);
  ASSERT_TRUE(reader.has_value()) << reader.error();
  EXPECT_TRUE(reader->check().has_value());
  std::uint64_t last = 0, longest = 0;
  int stepsBack = 0;
  for (auto message = reader->next(); message && *message; message = reader->next()) {
    const std::uint64_t time = (*message)->time;
    stepsBack += time < last;
    if (last > 0) longest = std::max(longest, time - last);
    last = std::max(last, time);
  }
  EXPECT_EQ(stepsBack, 0);
  EXPECT_LT(longest, static_cast<std::uint64_t>(std::chrono::nanoseconds(kLongestGap).count()));
  EXPECT_LT(static_cast<double>(reader->end() - reader->start()) * 1e-9, took.count());
  stopServer();
}

}  // namespace
}  // namespace clothstream::e2e
