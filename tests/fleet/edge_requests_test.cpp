// SPDX-License-Identifier: MIT
// What an edge asks an origin for, and when.
#include <chrono>
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include "server/fleet/description_download.h"
#include "server/fleet/interest_times.h"

namespace clothstream::fleet {
namespace {

using namespace std::chrono_literals;
using Clock = schedule::Clock;
using Added = DescriptionDownload::Added;

constexpr Clock::time_point kNow(1h);

v1::Chunk chunk(std::uint64_t content, std::uint32_t index, const std::string& data) {
  v1::Chunk chunk;
  chunk.set_content_id(content);
  chunk.set_index(index);
  chunk.set_count(2);
  chunk.set_total_bytes(4);
  chunk.set_data(data);
  return chunk;
}

TEST(DescriptionDownloadTest, ChunksComeInOrder) {
  DescriptionDownload download;
  EXPECT_EQ(download.add(chunk(7, 1, "cd")), Added::dropped);
  EXPECT_EQ(download.add(chunk(7, 0, "ab")), Added::incomplete);
  EXPECT_EQ(download.request(kNow).content_id(), 7U);
  EXPECT_EQ(download.request(kNow).index(), 1U);
  EXPECT_FALSE(download.isOverdue(kNow + 2s));
  EXPECT_TRUE(download.isOverdue(kNow + 3s));
  EXPECT_EQ(download.add(chunk(7, 1, "cde")), Added::dropped);
  EXPECT_EQ(download.add(chunk(7, 1, "cd")), Added::complete);
  EXPECT_EQ(download.bytes(), "abcd");
}

TEST(DescriptionDownloadTest, AnotherContentBeginsAgain) {
  DescriptionDownload download;
  EXPECT_EQ(download.add(chunk(7, 0, "ab")), Added::incomplete);
  EXPECT_EQ(download.add(chunk(8, 0, "ef")), Added::incomplete);
  EXPECT_EQ(download.add(chunk(7, 1, "cd")), Added::dropped);
  EXPECT_EQ(download.add(chunk(8, 1, "gh")), Added::complete);
  EXPECT_EQ(download.bytes(), "efgh");
}

TEST(InterestTimesTest, NewNeedsAreToldAtOnce) {
  InterestTimes interest;
  EXPECT_TRUE(interest.update({}, true, kNow));
  EXPECT_FALSE(interest.update({}, true, kNow + 900ms));
  EXPECT_TRUE(interest.update({.qualities = 1}, true, kNow + 900ms));
  EXPECT_TRUE(interest.update({.qualities = 1, .keyFrames = 1}, true, kNow + 910ms));
  EXPECT_FALSE(interest.update({.qualities = 1, .keyFrames = 1}, true, kNow + 1s));
  EXPECT_TRUE(interest.update({.qualities = 1, .keyFrames = 1}, true, kNow + 1010ms));
  EXPECT_FALSE(interest.update({.qualities = 1, .keyFrames = 1}, false, kNow + 2s));
  // A key frame that has come and is needed again is new.
  EXPECT_FALSE(interest.update({.qualities = 1}, true, kNow + 2s));
  EXPECT_TRUE(interest.update({.qualities = 1, .keyFrames = 1}, true, kNow + 2s));
}

}  // namespace
}  // namespace clothstream::fleet
