// SPDX-License-Identifier: MIT
// Recordings that are written, read back, truncated and damaged.
#include <chrono>
#include <fstream>
#include <random>
#include <string>

#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include "clothstream/v1/recording.pb.h"
#include "proto/codec/packet_header.h"
#include "proto/recording/file.h"
#include "proto/recording/frame_check.h"
#include "proto/recording/mcap_reader.h"
#include "proto/recording/recorded_description.h"
#include "proto/recording/recording_reader.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/recording/sample.h"

namespace clothstream::recording {
namespace {

using ::testing::HasSubstr;

std::uint64_t tickOf(std::string_view bytes) {
  v1::Frame frame;
  EXPECT_TRUE(frame.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
  return codec::parsePacket(std::as_bytes(std::span(frame.packet())))->header.tick;
}

TEST(Recording, RoundTrips) {
  RecordingReader reader = readerOf(sampleRecording(kSampleFrames));
  EXPECT_TRUE(reader.check().has_value());
  EXPECT_EQ(reader.metadata("scene"), "sample");
  EXPECT_EQ(reader.metadata("driver"), "unknown");
  EXPECT_EQ(readDescription(reader)->scene(), "sample");
  EXPECT_EQ(reader.start(), sampleTime(0));
  EXPECT_EQ(reader.end(), sampleTime(kSampleFrames - 1));
  std::uint64_t frames = 0, ticks = 0;
  for (auto message = reader.next(); *message; message = reader.next()) {
    if ((*message)->topic == Topic::frames) {
      EXPECT_EQ((*message)->time, sampleTime(frames));
      EXPECT_EQ(tickOf((*message)->bytes), ++frames);
    }
    if ((*message)->topic != Topic::ticks) continue;
    v1::RecordedTick tick;
    ASSERT_TRUE(tick.ParseFromArray((*message)->bytes.data(), static_cast<int>((*message)->bytes.size())));
    EXPECT_EQ(tick.tick(), ++ticks);
  }
  EXPECT_EQ(frames, kSampleFrames);
  EXPECT_EQ(ticks, kSampleFrames);
}

TEST(Recording, SchemasHaveWhatTheirMessagesContainAndNothingElse) {
  RecordingReader reader = readerOf(sampleRecording(1));
  ASSERT_EQ(reader.mcap().schemas().size(), kTopicNames.size());
  std::size_t bytes = 0;
  for (const auto& [id, schema] : reader.mcap().schemas()) {
    bytes += schema.data.size();
    google::protobuf::FileDescriptorSet files;
    ASSERT_TRUE(files.ParseFromString(schema.data)) << schema.name;
    google::protobuf::DescriptorPool pool;
    for (const google::protobuf::FileDescriptorProto& file : files.file())
      EXPECT_NE(pool.BuildFile(file), nullptr) << schema.name << ' ' << file.name();
    EXPECT_NE(pool.FindMessageTypeByName(schema.name), nullptr) << schema.name;
    EXPECT_EQ(pool.FindMessageTypeByName("clothstream.v1.ClientMessage"), nullptr) << schema.name;
  }
  EXPECT_LT(bytes, 40'000u);
}

TEST(Recording, HasChunksOfAtMostAFifthOfASecond) {
  RecordingReader reader = readerOf(sampleRecording(kSampleFrames));
  EXPECT_EQ(reader.mcap().chunks().size(), 13u);
  for (const ChunkPlace& chunk : reader.mcap().chunks())
    EXPECT_LT(chunk.end - chunk.start, McapWriter::kChunkNs);
}

TEST(Recording, IsCompleteWithoutMessages) {
  std::string bytes;
  McapWriter writer([&](std::string_view more) {
    bytes += more;
    return Written();
  });
  ASSERT_TRUE(writer.begin("test"));
  ASSERT_TRUE(writer.finish());
  auto reader = McapReader::open(std::make_unique<MemorySource>(bytes));
  ASSERT_TRUE(reader.has_value()) << reader.error();
  EXPECT_TRUE(reader->indexed());
  EXPECT_TRUE(reader->check().has_value());
}

TEST(Recording, SeeksToThePreviousKeyFrame) {
  RecordingReader reader = readerOf(sampleRecording(kSampleFrames));
  for (const std::uint32_t frame : {149u, 0u, 23u, 24u, 25u, 71u, 72u, 130u}) {
    ASSERT_TRUE(reader.seek(sampleTime(frame)));
    const auto message = reader.next();
    ASSERT_TRUE(message && *message);
    EXPECT_EQ((*message)->topic, Topic::frames);
    EXPECT_EQ(tickOf((*message)->bytes), frame / kMaxKeyFrameDistance * kMaxKeyFrameDistance + 1);
  }
  ASSERT_TRUE(reader.seek(0));
  EXPECT_EQ((*reader.next())->topic, Topic::description);
}

TEST(Recording, TruncationLosesAtMostOneChunk) {
  const std::string whole = sampleRecording(kSampleFrames);
  const RecordingReader reader = readerOf(whole);
  const std::uint64_t dataStart = reader.mcap().chunks().front().offset;
  for (std::uint64_t length = dataStart; length < whole.size(); length += 7) {
    const std::string cut = whole.substr(0, length);
    std::size_t wholeChunks = 0;
    for (const ChunkPlace& chunk : reader.mcap().chunks())
      if (chunk.offset + chunk.length <= length) ++wholeChunks;
    RecordingReader cutReader = readerOf(cut, CutFiles::read);
    EXPECT_FALSE(cutReader.mcap().indexed());
    ASSERT_EQ(cutReader.mcap().chunks().size(), wholeChunks) << length;
    // The contents are known without the index, except for the last chunk.
    for (std::size_t i = 0; i < wholeChunks; ++i) {
      const auto& channels = cutReader.mcap().chunks()[i].channels;
      if (channels || i + 1 < wholeChunks) {
        ASSERT_EQ(channels, reader.mcap().chunks()[i].channels) << length;
      }
    }
    EXPECT_FALSE(cutReader.check().has_value());
  }
  RecordingReader half = readerOf(whole.substr(0, whole.size() / 2), CutFiles::read);
  const std::size_t frames = countMessages(half, Topic::frames);
  EXPECT_GT(frames, kSampleFrames / 4);
  EXPECT_LT(frames, std::size_t{kSampleFrames});
}

TEST(Recording, ReportsTruncationInItsHeaders) {
  const std::string whole = sampleRecording(10);
  const std::uint64_t dataStart = readerOf(whole).mcap().chunks().front().offset;
  for (std::uint64_t length = 0; length < dataStart; ++length) {
    const auto reader = RecordingReader::open(std::make_unique<MemorySource>(whole.substr(0, length)), "cut",
                                              CutFiles::refused);
    ASSERT_FALSE(reader.has_value()) << length;
    EXPECT_THAT(reader.error(), HasSubstr("cut"));
  }
}

TEST(Recording, DetectsFlippedBits) {
  const std::string whole = sampleRecording(30);
  for (std::size_t bit = 0; bit < 8 * whole.size(); bit += 61) {
    std::string damaged = whole;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    auto reader =
        RecordingReader::open(std::make_unique<MemorySource>(std::move(damaged)), "sample", CutFiles::read);
    EXPECT_FALSE(reader && reader->check()) << "bit " << bit;
  }
}

TEST(Recording, ReadsAnyBytesSafely) {
  const std::string whole = sampleRecording(40);
  std::mt19937 random(1);
  for (int round = 0; round < 4000; ++round) {
    std::string bytes = whole;
    for (unsigned i = 0, changes = 1 + random() % 8; i < changes; ++i) {
      const std::size_t at = random() % bytes.size();
      switch (random() % 4) {
        case 0:
          bytes[at] = static_cast<char>(random());
          break;
        case 1:  // a length or an offset that is huge
          bytes.replace(at, std::min<std::size_t>(8, bytes.size() - at), 8, static_cast<char>(0xff));
          break;
        case 2:
          bytes.erase(at, random() % 64);
          break;
        default:
          bytes.insert(at, whole.substr(random() % whole.size(), random() % 64));
      }
    }
    auto reader = RecordingReader::open(std::make_unique<MemorySource>(bytes), "hostile", CutFiles::read);
    if (!reader) continue;
    for (const Topic topic : {Topic::frames, Topic::ticks}) {
      reader->rewind();
      countMessages(*reader, topic);
    }
    (void)reader->seek(random());
    (void)readDescription(*reader);
    (void)reader->check();
  }
}

// A file with chunks of zeros, which are compressed to almost nothing.
std::string zeros(std::size_t chunks, std::size_t bytes) {
  std::string file;
  McapWriter writer([&](std::string_view more) {
    file += more;
    return Written();
  });
  EXPECT_TRUE(writer.begin("test"));
  const auto channel = writer.addChannel("/zeros", {"Zeros", ""});
  EXPECT_TRUE(channel.has_value());
  for (std::size_t i = 0; i < chunks; ++i) {
    EXPECT_TRUE(writer.write(*channel, i, std::string(bytes, '\0')));
    EXPECT_TRUE(writer.closeChunk());
  }
  EXPECT_TRUE(writer.finish());
  return file;
}

TEST(Recording, RefusesChunksThatExpandTooMuchBeforeReadingThem) {
  constexpr McapLimits kLimits{.chunkBytes = 100'000, .expansion = 2, .freeChunks = 3};
  const auto open = [&](const std::string& file) {
    return McapReader::open(std::make_unique<MemorySource>(file), kLimits);
  };
  EXPECT_TRUE(open(zeros(3, 90'000)).has_value());
  const std::string bomb = zeros(10, 90'000);
  ASSERT_LT(bomb.size(), 10'000u);
  const auto refused = open(bomb);
  ASSERT_FALSE(refused.has_value());
  EXPECT_THAT(refused.error(), HasSubstr("would expand to more than 2 times the size of the file"));
  // Without its index it is refused, too.
  const auto reader = McapReader::open(std::make_unique<MemorySource>(bomb));
  const auto cut = open(bomb.substr(0, reader->dataEnd()));
  ASSERT_FALSE(cut.has_value());
  EXPECT_THAT(cut.error(), HasSubstr("would expand"));
}

// A tick has the joints of eight meshes, and repeats them while they stand still.
TEST(Recording, ReadsTicksOfJointsThatStandStill) {
  constexpr std::uint32_t kMeshes = 8, kJoints = 128;
  const std::vector<float> joints(std::size_t{7} * kJoints);
  std::string file;
  McapWriter writer([&](std::string_view more) {
    file += more;
    return Written();
  });
  ASSERT_TRUE(writer.begin("test"));
  const auto channel = writer.addChannel("/ticks", {"RecordedTick", ""});
  std::mt19937_64 random(3);
  v1::RecordedTick tick;
  for (std::uint32_t i = 0; i < kMeshes; ++i) {
    v1::AppliedCollider& collider = *tick.add_colliders();
    collider.mutable_joints_start()->Add(joints.begin(), joints.end());
    collider.mutable_joints_end()->Add(joints.begin(), joints.end());
  }
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    tick.set_tick(i);
    tick.set_state_hash(random());
    ASSERT_TRUE(writer.write(*channel, i * 1'000'000, tick.SerializeAsString()));
  }
  ASSERT_TRUE(writer.finish());
  const auto reader = McapReader::open(std::make_unique<MemorySource>(file), {.freeChunks = 0});
  EXPECT_TRUE(reader.has_value()) << reader.error();
}

TEST(Recording, ReadsTheOthersIfAChunkIsTooLarge) {
  auto reader = McapReader::open(std::make_unique<MemorySource>(zeros(3, 90'000)), {.chunkBytes = 80'000});
  ASSERT_TRUE(reader.has_value()) << reader.error();
  const auto messages = reader->read(1);
  ASSERT_FALSE(messages.has_value());
  EXPECT_THAT(messages.error(), HasSubstr("90031 bytes; chunks of at most 80000 are read"));
  EXPECT_FALSE(reader->check().has_value());
}

// An index that names one chunk many times would make a small file cost as much as a large one.
TEST(Recording, IgnoresAnIndexThatNamesAChunkTwice) {
  std::string file = zeros(2, 1000);
  const auto whole = McapReader::open(std::make_unique<MemorySource>(file));
  ASSERT_TRUE(whole.has_value() && whole->indexed());
  const std::uint64_t first = whole->chunks()[0].offset, second = whole->chunks()[1].offset;
  const std::string was(reinterpret_cast<const char*>(&second), sizeof second),
      is(reinterpret_cast<const char*>(&first), sizeof first);
  const std::size_t at = file.rfind(was);
  ASSERT_NE(at, file.npos);
  file.replace(at, was.size(), is);
  constexpr std::size_t kCrcBytes = 4;
  file.replace(file.size() - kMagic.size() - kCrcBytes, kCrcBytes, kCrcBytes, '\0');  // 0: unknown
  const auto reader = McapReader::open(std::make_unique<MemorySource>(file));
  ASSERT_TRUE(reader.has_value());
  EXPECT_FALSE(reader->indexed());
  EXPECT_EQ(reader->chunks().size(), 2u);
  EXPECT_EQ(reader->chunks()[1].offset, second);
}

TEST(Recording, RefusesADescriptionBeyondTheLimits) {
  const std::string bytes =
      withMessages(sampleRecording(3), Topic::description, [](std::size_t, std::string& message) {
        v1::StreamDescription description = sampleDescription();
        description.mutable_cloths(0)->set_vertex_count(4'000'000);
        message = description.SerializeAsString();
      });
  RecordingReader reader = readerOf(bytes);
  const auto description = readDescription(reader);
  ASSERT_FALSE(description.has_value());
  EXPECT_THAT(description.error(), HasSubstr("4000000 vertices; at most 1048576 are read"));
}

FrameFaults faultsOf(const std::string& bytes) {
  RecordingReader reader = readerOf(bytes);
  auto check = FrameCheck::make(layoutOf(*readDescription(reader)));
  for (auto message = reader.next(); *message; message = reader.next())
    if ((*message)->topic == Topic::frames)
      check->take((*message)->bytes, static_cast<double>((*message)->time - reader.start()) * 1e-9);
  return check->faults();
}

TEST(FrameCheck, CountsFramesWithFaultsAndNamesTheFirst) {
  const std::string whole = sampleRecording(kSampleFrames);
  EXPECT_FALSE(faultsOf(whole).any());
  EXPECT_EQ(faultsOf(whole).frames(), kSampleFrames);
  EXPECT_EQ(faultsOf(withGarbage(whole)).text(),
            "of 150 frames 150 cannot be decoded, the first is that of an unknown tick at 0.000 s");
  // All frames that refer to a frame with a fault are left out with it.
  EXPECT_EQ(
      faultsOf(withFrames(whole,
                          [](std::size_t frame, v1::Frame& changed) {
                            if (frame == 30) changed.set_reconstruction_hash(0);
                          }))
          .text(),
      "of 150 frames 17 cannot be decoded and 1 differ from their recorded hash, the first is that of tick "
      "31 at 0.500 s");
}

TEST(FrameCheck, RefusesAReservedCodecAndNamesIt) {
  v1::StreamDescription description = sampleDescription();
  description.set_codec(3);
  const auto check = FrameCheck::make(layoutOf(description));
  ASSERT_FALSE(check.has_value());
  EXPECT_EQ(check.error(), "its stream has the unknown codec 3; this version decodes codec 2");
}

TEST(Recording, ReportsTheKindOfOtherFiles) {
  const e2e::TemporaryDirectory directory;
  const auto errorOf = [&](const char* name, const std::string& content) {
    const auto path = directory.path() / name;
    std::ofstream(path, std::ios::binary) << content;
    return RecordingReader::open(path.string()).error();
  };
  EXPECT_THAT(RecordingReader::open((directory.path() / "none").string()).error(),
              HasSubstr("none: No such file or directory"));
  EXPECT_THAT(RecordingReader::open(directory.path().string()).error(), HasSubstr("not a regular file"));
  EXPECT_THAT(errorOf("empty", ""), HasSubstr("not an MCAP file: too short"));
  EXPECT_THAT(errorOf("text", "This is a text."), HasSubstr("not an MCAP file"));
  std::string later = sampleRecording(3);
  later[kVersionByte] = '1';
  EXPECT_THAT(errorOf("later", later), HasSubstr("MCAP of version '1'"));
  std::string cut = sampleRecording(40);
  cut.resize(cut.size() / 2);
  EXPECT_THAT(errorOf("cut", cut), HasSubstr("clothstream recover"));
  std::string other;
  McapWriter writer([&](std::string_view more) {
    other += more;
    return Written();
  });
  ASSERT_TRUE(writer.begin("another program") && writer.finish());
  EXPECT_THAT(errorOf("other", other), HasSubstr("no recording of clothstream"));
}

TEST(Recording, PassesOnTheSinksErrorAndStopsWriting) {
  std::size_t calls = 0;
  McapWriter writer([&](std::string_view) -> Written {
    if (++calls == 3) return tl::unexpected(std::string("no room"));
    return {};
  });
  ASSERT_TRUE(writer.begin("test"));
  EXPECT_EQ(writer.addMetadata("a", {}).error(), "no room");
  EXPECT_EQ(writer.write(1, 0, "x").error(), "no room");
  EXPECT_EQ(writer.finish().error(), "no room");
  EXPECT_EQ(calls, 3u);
}

TEST(OutputFile, NeverReplacesAFile) {
  const e2e::TemporaryDirectory directory;
  const std::string path = (directory.path() / "file").string();
  std::ofstream(path) << "mine";
  EXPECT_THAT(OutputFile::create(path).error(), HasSubstr("File exists"));
}

// Five minutes at 60 frames a second. tests/bench/recording.cpp measures an hour.
TEST(Recording, SeeksToThePreviousKeyFrameInALongRecording) {
  const e2e::TemporaryDirectory directory;
  const std::string path = (directory.path() / "minutes").string();
  constexpr std::uint32_t kMinutes = 5 * 60 * kSampleRate;
  {
    auto file = OutputFile::create(path);
    ASSERT_TRUE(file.has_value());
    writeSample([&](std::string_view bytes) { return file->write(bytes); }, kMinutes);
  }
  auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.has_value()) << reader.error();
  std::mt19937 random(2);
  for (int i = 0; i < 200; ++i) {
    const auto frame = static_cast<std::uint32_t>(random() % kMinutes);
    ASSERT_TRUE(reader->seek(sampleTime(frame)));
    const auto message = reader->next();
    ASSERT_EQ(tickOf((*message)->bytes), frame / kMaxKeyFrameDistance * kMaxKeyFrameDistance + 1);
  }
}

}  // namespace
}  // namespace clothstream::recording
