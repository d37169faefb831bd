// SPDX-License-Identifier: MIT
// Plays a recording to a program that uses libclothstream, and compares what the program makes of each frame
// with what is committed. Runs in examples/testing. UPDATE_EXPECTED=1 writes what is compared.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include <clothstream/clothstream.h>
#include <clothstream/testing.h>
#include <gtest/gtest.h>

namespace {

// The program under test: follows a stream to the end of the recording, and describes each frame in a line.
std::string describeFrames(const std::string& address) {
  clothstream_stream* stream = nullptr;
  if (clothstream_open(address.c_str(), nullptr, &stream) != CLOTHSTREAM_OK) return clothstream_error_text();
  std::string lines;
  std::uint32_t events = 0;
  for (bool ends = false;
       !ends && clothstream_wait(stream, 10'000, &events) == CLOTHSTREAM_OK && events != 0;) {
    cs_client* client = clothstream_acquire(stream);
    if ((events & CS_EVENT_FRAME) != 0) {
      cs_statistics statistics;
      cs_get_statistics(client, clothstream_now_us(), &statistics);
      const float* positions = cs_positions(client);
      float lowest = positions[1];
      for (std::uint32_t i = 0; i < cs_vertex_count(client); ++i)
        lowest = std::min(lowest, positions[3 * i + 1]);
      char line[80];
      std::snprintf(line, sizeof line, "%llu %016llx %.9g\n",
                    static_cast<unsigned long long>(statistics.tick),
                    static_cast<unsigned long long>(cs_reconstruction_hash(client)), lowest);
      lines += line;
    }
    cs_playback playback;
    ends = cs_get_playback(client, clothstream_now_us(), &playback) == 1 && playback.paused != 0;
    clothstream_release(stream);
  }
  clothstream_close(stream);
  return lines;
}

std::string readFile(const char* path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Cloth : public clothstream::testing::ServerTest {};

TEST_F(Cloth, IsTheSameInEveryFrame) {
  play("cloth.mcap");
  const std::string lines = describeFrames(address());
  if (std::getenv("UPDATE_EXPECTED") != nullptr) std::ofstream("cloth.frames") << lines;
  EXPECT_EQ(lines, readFile("cloth.frames"));
}

// The same seed gives the same lost and late frames.
TEST_F(Cloth, IsTheSameAfterTheSameFaults) {
  clothstream::testing::PlayOptions options;
  options.faults = 4;
  play("cloth.mcap", options);
  const std::string once = describeFrames(address());
  play("cloth.mcap", options);
  EXPECT_EQ(describeFrames(address()), once);
  EXPECT_LT(once.size(), readFile("cloth.frames").size());
}

}  // namespace
