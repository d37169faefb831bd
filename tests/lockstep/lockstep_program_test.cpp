// SPDX-License-Identifier: MIT
// `clothstream-server play --lockstep` with libclothstream: a program sees every frame of a recording.
#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <clothstream/clothstream.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "proto/recording/file.h"
#include "tests/e2e/link.h"
#include "tests/e2e/server_process.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/recording/sample.h"

namespace clothstream::recording {
namespace {

using ::testing::HasSubstr;
using tests::ServerProcess;

struct SeenFrame {
  std::uint64_t tick = 0, hash = 0;
  bool operator==(const SeenFrame&) const = default;
};
using SeenFrames = std::vector<SeenFrame>;

// More acknowledgements per second than a server accepts of other messages.
constexpr std::uint32_t kFrames = 3000;

// A stream of libclothstream.
class Stream {
 public:
  explicit Stream(const std::string& address) {
    EXPECT_EQ(clothstream_open(address.c_str(), nullptr, &stream_), CLOTHSTREAM_OK)
        << clothstream_error_text();
  }
  ~Stream() { clothstream_close(stream_); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  // Follows the recording to its end, with clothstream_wait.
  SeenFrames toTheEnd() {
    return until([](const SeenFrames&) { return false; });
  }
  // Returns when the recording is at its end, or `enough` returns true after a frame.
  template <typename Enough>
  SeenFrames until(const Enough& enough) {
    SeenFrames seen;
    std::uint32_t events = 0;
    for (int idle = 0; idle < kIdleWaits && clothstream_wait(stream_, kWaitMs, &events) == CLOTHSTREAM_OK;
         idle = events == 0 ? idle + 1 : 0) {
      cs_client* client = clothstream_acquire(stream_);
      if ((events & CS_EVENT_FRAME) != 0) seen.push_back(newest(client));
      if ((events & CS_EVENT_ERROR) != 0) ADD_FAILURE() << cs_error_text(client);
      const bool ends = (events & CS_EVENT_PLAYBACK) != 0 && atEnd(client);
      clothstream_release(stream_);
      if (ends || ((events & CS_EVENT_FRAME) != 0 && enough(seen))) return seen;
    }
    ADD_FAILURE() << "the recording did not come to its end: " << clothstream_error_text();
    return seen;
  }
  // Follows the recording to its end without clothstream_wait, as a program with a loop that draws.
  SeenFrames pollToTheEnd() {
    SeenFrames seen;
    for (bool ends = false; !ends; std::this_thread::yield()) {
      cs_client* client = clothstream_acquire(stream_);
      if (const SeenFrame frame = newest(client);
          frame.tick != 0 && (seen.empty() || frame.tick != seen.back().tick))
        seen.push_back(frame);
      ends = atEnd(client) || cs_get_state(client) == CS_STATE_FAILED;
      clothstream_release(stream_);
    }
    return seen;
  }
  clothstream_stream* get() const { return stream_; }

 private:
  // A wait without events is over after a lost connection, too.
  static constexpr std::uint32_t kWaitMs = 5'000;
  static constexpr int kIdleWaits = 12;

  static SeenFrame newest(cs_client* client) {
    cs_statistics statistics;
    cs_get_statistics(client, clothstream_now_us(), &statistics);
    EXPECT_EQ(statistics.hash_mismatches, 0u);
    return {statistics.tick, cs_reconstruction_hash(client)};
  }
  static bool atEnd(const cs_client* client) {
    cs_playback playback;
    return cs_get_playback(client, clothstream_now_us(), &playback) == 1 && playback.paused != 0;
  }

  clothstream_stream* stream_ = nullptr;
};

class LockstepProgram : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    directory_ = std::make_unique<e2e::TemporaryDirectory>();
    path_ = (directory_->path() / "sample.mcap").string();
    auto file = OutputFile::create(path_);
    ASSERT_TRUE(file.has_value());
    writeSample([&](std::string_view bytes) { return file->write(bytes); }, kFrames);
  }
  static void TearDownTestSuite() { directory_.reset(); }

  // Plays in lockstep, as fast as the clients acknowledge.
  void play(std::vector<std::string> more = {}) {
    std::vector<std::string> options{"--port", "0",          "--grpc-port", "0",  "play",
                                     path_,    "--lockstep", "--speed",     "max"};
    options.insert(options.end(), more.begin(), more.end());
    server_ = std::make_unique<ServerProcess>(options);
    const std::string line = server_->lineWith("page    ");
    port_ = server_->portIn(line);
    address_ = "127.0.0.1:" + std::to_string(port_);
  }
  SeenFrames framesOf(std::vector<std::string> more) {
    play(std::move(more));
    return Stream(address_).toTheEnd();
  }
  static SeenFrames recorded() {
    SeenFrames frames;
    auto reader = RecordingReader::open(path_);
    for (auto message = reader->next(); *message; message = reader->next()) {
      if ((*message)->topic != Topic::frames) continue;
      v1::Frame frame;
      frame.ParseFromArray((*message)->bytes.data(), static_cast<int>((*message)->bytes.size()));
      frames.push_back({frames.size() + 1, frame.reconstruction_hash()});
    }
    return frames;
  }

  static inline std::unique_ptr<e2e::TemporaryDirectory> directory_;
  static inline std::string path_;
  std::unique_ptr<ServerProcess> server_;
  std::uint16_t port_ = 0;
  std::string address_;
};

TEST_F(LockstepProgram, ShowsEveryFrameOnceInOrder) {
  play();
  const SeenFrames seen = Stream(address_).toTheEnd(), all = recorded();
  ASSERT_EQ(all.size(), kFrames);
  EXPECT_EQ(seen, all);
}

TEST_F(LockstepProgram, ShowsEveryFrameToAProgramThatDoesNotWait) {
  play({"--from", "46"});
  const SeenFrames seen = Stream(address_).pollToTheEnd(), all = recorded();
  ASSERT_GT(seen.size(), 200u);
  ASSERT_LT(seen.size(), 300u);
  EXPECT_EQ(seen, SeenFrames(all.end() - static_cast<std::ptrdiff_t>(seen.size()), all.end()));
}

TEST_F(LockstepProgram, ShowsEveryFrameToEachOfTwoPrograms) {
  play({"--wait-for", "2"});
  SeenFrames first;
  std::thread other([&] { first = Stream(address_).toTheEnd(); });
  const SeenFrames second = Stream(address_).toTheEnd();
  other.join();
  EXPECT_EQ(first, recorded());
  EXPECT_EQ(second, first);
}

TEST_F(LockstepProgram, GivesTheSameFramesForTheSameFaults) {
  // The last 10 s, because delays take their time.
  const auto withSeed = [&](const char* seed) { return framesOf({"--from", "40", "--faults", seed}); };
  const SeenFrames seen = withSeed("1"), all = recorded();
  EXPECT_LT(seen.size(), 600u);
  EXPECT_GT(seen.size(), 100u);
  auto at = all.begin();
  for (const SeenFrame& frame : seen) {
    at = std::find(at, all.end(), frame);
    ASSERT_NE(at, all.end()) << "tick " << frame.tick << " is not of the recording, or out of order";
  }
  EXPECT_EQ(withSeed("1"), seen);
  EXPECT_NE(withSeed("2"), seen);
}

TEST_F(LockstepProgram, ContinuesAfterAReconnect) {
  play();
  e2e::Link link(port_);
  Stream stream("127.0.0.1:" + std::to_string(link.port()));
  const auto half = [](const SeenFrames& seen) { return seen.size() == kFrames / 2; };
  ASSERT_EQ(stream.until(half).size(), kFrames / 2);
  link.cut();
  link.restore();
  const SeenFrames rest = stream.toTheEnd(), all = recorded();
  // It continues from the key frame before, with larger ticks.
  ASSERT_GE(rest.size(), kFrames / 2);
  ASSERT_LE(rest.size(), kFrames / 2 + kMaxKeyFrameDistance);
  EXPECT_GT(rest.front().tick, kFrames / 2);
  EXPECT_EQ(rest.back().hash, all.back().hash);
}

TEST_F(LockstepProgram, ContinuesWhereAnOwnerSeeks) {
  play();
  Stream stream(address_);
  stream.until([](const SeenFrames& seen) { return seen.size() == 100; });
  cs_client* client = clothstream_acquire(stream.get());
  cs_seek(client, 49);
  clothstream_release(stream.get());
  const SeenFrames rest = stream.toTheEnd();
  EXPECT_LT(rest.size(), 200u);
  EXPECT_EQ(rest.back().hash, recorded().back().hash);
}

TEST_F(LockstepProgram, RefusesADamagedRecording) {
  std::string bytes = sampleRecording(kSampleFrames);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  const std::string path = (directory_->path() / "damaged.mcap").string();
  ASSERT_TRUE(OutputFile::create(path)->write(bytes));
  ServerProcess server({"play", path, "--lockstep"});
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.output(), HasSubstr("checksum"));
  EXPECT_THAT(server.output(), HasSubstr("--lockstep plays only whole recordings"));
}

TEST(LockstepOptions, RefuseMaximumSpeedWithoutLockstep) {
  ServerProcess server({"play", "x.mcap", "--speed", "max"});
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.output(), HasSubstr("--speed: max requires --lockstep; use 0.1 to 8 without it"));
}

TEST(LockstepOptions, RefuseOtherSpeeds) {
  ServerProcess server({"play", "x.mcap", "--lockstep", "--speed", "9"});
  EXPECT_EQ(server.exitCode(), 1);
  EXPECT_THAT(server.output(), HasSubstr("--speed: 9 is out of range; use 0.1 to 8"));
}

}  // namespace
}  // namespace clothstream::recording
