// SPDX-License-Identifier: MIT
// Motion files: reading, writing, refusing invalid ones.
#include "clients/files/motion_file.h"

#include <cmath>
#include <fstream>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/e2e/temporary_directory.h"
#include "tests/files/written_motion.h"

namespace clothstream::files {
namespace {

using ::testing::ElementsAreArray;
using ::testing::HasSubstr;

class MotionFile : public ::testing::Test {
 protected:
  std::filesystem::path path() const { return directory_.path() / "motion"; }

  // Error for a file with this header and this number of bytes after it; empty if the file is accepted.
  std::string errorFor(std::array<std::int32_t, 4> header, std::size_t bytes) const {
    std::ofstream file(path(), std::ios::binary);
    file.write(reinterpret_cast<const char*>(header.data()), sizeof header);
    file << std::string(bytes, '\0');
    file.close();
    const auto reader = MotionReader::open(path());
    return reader ? "" : reader.error();
  }

 private:
  e2e::TemporaryDirectory directory_;
};

TEST_F(MotionFile, ReadsFrameByFrame) {
  const MotionContent content = waves({.columns = 7, .rows = 5, .frames = 3});
  writeMotion(content, path());
  auto reader = MotionReader::open(path());
  ASSERT_TRUE(reader) << reader.error();
  EXPECT_EQ(reader->shape().columns, 7u);
  EXPECT_EQ(reader->shape().rows, 5u);
  for (std::uint32_t frame = 0; frame < 3; ++frame) {
    const auto positions = reader->next();
    ASSERT_TRUE(positions) << positions.error();
    EXPECT_THAT(*positions, ElementsAreArray(content.positions(frame)));
    const auto normals = reader->normals();
    ASSERT_TRUE(normals) << normals.error();
    EXPECT_THAT(*normals, ElementsAreArray(content.normals(frame)));
  }
}

TEST_F(MotionFile, WritesWhatItReads) {
  const MotionContent content = waves({.columns = 4, .rows = 6, .frames = 2});
  {
    auto writer = MotionWriter::create(path(), content.shape);
    ASSERT_TRUE(writer) << writer.error();
    for (std::uint32_t frame = 0; frame < 2; ++frame)
      ASSERT_TRUE(writer->append(content.positions(frame), content.normals(frame)));
    ASSERT_TRUE(writer->finish());
  }
  const MotionContent back = readMotion(path());
  EXPECT_EQ(back.shape.columns, 4u);
  EXPECT_EQ(back.shape.rows, 6u);
  EXPECT_EQ(back.shape.frames, 2u);
  EXPECT_EQ(back.floats, content.floats);
}

TEST_F(MotionFile, RefusesInvalidHeaderOrLength) {
  EXPECT_THAT(MotionReader::open(path()).error(), HasSubstr("No such file"));
  EXPECT_THAT(MotionReader::open("/dev/zero").error(), HasSubstr("not a regular file"));
  std::ofstream(path()) << "short";
  EXPECT_THAT(MotionReader::open(path()).error(), HasSubstr("it has 5 bytes"));
  constexpr std::size_t kFrame = 2 * 3 * 4 * 6;
  EXPECT_EQ(errorFor({2, 3, 1, 0}, kFrame), "");
  EXPECT_THAT(errorFor({2, 3, 1, 1}, kFrame), HasSubstr("2 columns, 3 rows, 1 frames and 1"));
  EXPECT_THAT(errorFor({0, 3, 1, 0}, kFrame), HasSubstr("0 columns"));
  EXPECT_THAT(errorFor({2, -3, 1, 0}, kFrame), HasSubstr("-3 rows"));
  EXPECT_THAT(errorFor({2, 3, 0, 0}, kFrame), HasSubstr("0 frames"));
  EXPECT_THAT(errorFor({65536, 65536, 1, 0}, kFrame), HasSubstr("at most"));
  EXPECT_THAT(errorFor({2, 3, 2, 0}, kFrame),
              HasSubstr("it has 160 bytes; 2 frames of 2x3 vertices need 304"));
  EXPECT_THAT(errorFor({2, 3, 1, 0}, kFrame + 1), HasSubstr("it has 161 bytes"));
  EXPECT_THAT(errorFor({2, 3, std::numeric_limits<std::int32_t>::max(), 0}, kFrame),
              HasSubstr("it has 160 bytes"));
}

TEST_F(MotionFile, RefusesPositionThatIsNotFinite) {
  MotionContent content = waves({.columns = 3, .rows = 2, .frames = 2});
  // The y coordinate of vertex 4 in frame 1.
  content.floats[2 * 18 + 3 * 4 + 1] = std::numeric_limits<float>::quiet_NaN();
  writeMotion(content, path());
  auto reader = MotionReader::open(path());
  ASSERT_TRUE(reader) << reader.error();
  EXPECT_TRUE(reader->next());
  EXPECT_THAT(reader->next().error(), HasSubstr("in frame 1 (of 0 to 1), vertex 4 has the coordinate nan"));
}

TEST(MeanEdge, AveragesEdgesBetweenNeighbours) {
  const std::vector<float> positions{0, 0, 0, 3, 0, 0, 0, 4, 0, 3, 4, 12};
  // The edges at the first vertex are 3 and 4 long, those at the last hypot(4, 12) and hypot(3, 12).
  EXPECT_DOUBLE_EQ(meanEdge({.columns = 2, .rows = 2, .frames = 1}, positions),
                   (3 + 4 + std::hypot(4, 12) + std::hypot(3, 12)) / 4);
  EXPECT_EQ(meanEdge({.columns = 1, .rows = 1, .frames = 1}, std::span(positions).first(3)), 0);
}

}  // namespace
}  // namespace clothstream::files
