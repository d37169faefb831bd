// SPDX-License-Identifier: MIT
// Stream files: reading returns what was written; damaged bytes are detected or harmless.
#include "clients/files/recording.h"

#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/e2e/temporary_directory.h"

namespace clothstream::files {
namespace {

using ::testing::HasSubstr;

class StreamFile : public ::testing::Test {
 protected:
  void SetUp() override {
    auto writer = RecordingWriter::create(path(), {.layout = {.epoch = 7,
                                                              .codec = codec::kCodecHierarchical,
                                                              .maxError = 0.002f,
                                                              .normals = codec::NormalMode::octahedral,
                                                              .qualities = 3,
                                                              .cloths = {{12, 3, 4, {}}}},
                                                   .rate = 72,
                                                   .frames = 2,
                                                   .side = Side::back});
    ASSERT_TRUE(writer) << writer.error();
    ASSERT_TRUE(writer->append(std::as_bytes(std::span(first_)), 0x0123456789abcdef));
    ASSERT_TRUE(writer->append({}, 5));
    ASSERT_TRUE(writer->finish());
    std::ifstream file(path(), std::ios::binary);
    whole_.assign(std::istreambuf_iterator<char>(file), {});
    EXPECT_EQ(writer->bytes(), whole_.size());
  }

  std::filesystem::path path() const { return directory_.path() / "recording"; }

  // First error when a file with these bytes is read; empty without an error.
  std::string errorOf(const std::string& bytes) const {
    std::ofstream(path(), std::ios::binary) << bytes;
    auto reader = RecordingReader::open(path());
    if (!reader) return reader.error();
    for (std::uint32_t frame = 0; frame < reader->head().frames; ++frame)
      if (const auto packet = reader->next(); !packet) return packet.error();
    return {};
  }

  const std::string first_ = "a packet";
  std::string whole_;

 private:
  e2e::TemporaryDirectory directory_;
};

TEST_F(StreamFile, ReadsWhatWasWritten) {
  auto reader = RecordingReader::open(path());
  ASSERT_TRUE(reader) << reader.error();
  const RecordingHead& head = reader->head();
  EXPECT_EQ(head.frames, 2u);
  EXPECT_EQ(head.rate, 72u);
  EXPECT_EQ(head.side, Side::back);
  EXPECT_EQ(head.layout.epoch, 7u);
  EXPECT_EQ(head.layout.codec, codec::kCodecHierarchical);
  EXPECT_EQ(head.layout.maxError, 0.002f);
  EXPECT_EQ(head.layout.normals, codec::NormalMode::octahedral);
  EXPECT_EQ(head.layout.qualities, 3);
  ASSERT_EQ(head.layout.cloths.size(), 1u);
  EXPECT_EQ(head.layout.cloths[0].rows, 3u);
  EXPECT_EQ(head.layout.cloths[0].columns, 4u);
  const auto first = reader->next();
  ASSERT_TRUE(first) << first.error();
  EXPECT_EQ(first->bytes, first_);
  EXPECT_EQ(first->reconstructionHash, 0x0123456789abcdefu);
  const auto second = reader->next();
  ASSERT_TRUE(second) << second.error();
  EXPECT_EQ(second->bytes, "");
}

TEST_F(StreamFile, RefusesTruncatedFile) {
  ASSERT_EQ(errorOf(whole_), "");
  for (std::size_t length = 0; length < whole_.size(); ++length)
    EXPECT_THAT(errorOf(whole_.substr(0, length)),
                HasSubstr(length < 12 ? "its first bytes differ" : "is broken"))
        << length << " of " << whole_.size();
  EXPECT_THAT(errorOf(whole_ + '\0'), HasSubstr("there are bytes after its 2 frames"));
}

TEST_F(StreamFile, ReadsDamagedFileSafely) {
  std::size_t detected = 0;
  for (std::size_t at = 0; at < whole_.size(); ++at)
    for (const int flip : {0x01, 0x80, 0xff}) {
      std::string damaged = whole_;
      damaged[at] = static_cast<char>(damaged[at] ^ flip);
      detected += errorOf(damaged).empty() ? 0 : 1;
    }
  // The decoder and its hash detect the rest.
  EXPECT_GT(detected, whole_.size());
}

TEST_F(StreamFile, RefusesAReservedCodecAndNamesIt) {
  ASSERT_TRUE(RecordingWriter::create(
                  path(), {.layout = {.codec = 3, .cloths = {{12, 3, 4, {}}}}, .rate = 72, .frames = 1})
                  ->finish());
  EXPECT_THAT(RecordingReader::open(path()).error(),
              HasSubstr("has the unknown codec 3; this version decodes codec 2"));
}

TEST_F(StreamFile, RefusesOtherFile) {
  EXPECT_THAT(errorOf("not one"), HasSubstr("is not a file of clothstream encode"));
  EXPECT_THAT(errorOf(std::string(100000, '\xff')), HasSubstr("is not a file of clothstream encode"));
  EXPECT_THAT(RecordingReader::open("/missing").error(), HasSubstr("No such file"));
}

}  // namespace
}  // namespace clothstream::files
