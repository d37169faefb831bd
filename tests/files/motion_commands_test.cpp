// SPDX-License-Identifier: MIT
// Runs `clothstream encode` and `decode`.
#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "clients/files/recording.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/vertex_normals.h"
#include "tests/e2e/process.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/files/written_motion.h"

namespace clothstream::files {
namespace {

using namespace std::chrono_literals;
using e2e::Process;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Enough for sanitizers on a busy machine.
constexpr auto kEnd = 120s;

constexpr int kUsage = 2, kNotWritten = 6, kUnreadable = 7;
constexpr MotionShape kShape{.columns = 24, .rows = 17, .frames = 40};

class MotionCommands : public ::testing::Test {
 protected:
  void SetUp() override {
    content_ = waves(kShape);
    writeMotion(content_, motion_);
  }

  struct Result {
    int code;
    std::string output, errors;
  };

  static Result run(std::vector<std::string> command) {
    Process process(command);
    const auto code = process.waitForEnd(kEnd);
    return {code.value_or(-1), process.output(), process.errors()};
  }
  static Result clothstream(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), CLOTHSTREAM);
    return run(std::move(arguments));
  }

  // Encodes and decodes the motion. Returns the summary of encode.
  nlohmann::json roundTrip(const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments{"encode", motion_, stream_, "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Result encoded = clothstream(arguments);
    EXPECT_EQ(encoded.code, 0) << encoded.errors;
    const Result decoded = clothstream({"decode", stream_, frames_});
    EXPECT_EQ(decoded.code, 0) << decoded.errors;
    return nlohmann::json::parse(encoded.output);
  }

  std::string streamBytes() const {
    std::ifstream file(stream_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }

  std::vector<std::string> filesThere() const {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path()))
      names.push_back(entry.path().filename());
    std::ranges::sort(names);
    return names;
  }

 private:
  e2e::TemporaryDirectory directory_;

 protected:
  const std::filesystem::path motion_ = directory_.path() / "motion", stream_ = directory_.path() / "stream",
                              frames_ = directory_.path() / "frames";
  MotionContent content_;
};

double largestDistance(std::span<const float> a, std::span<const float> b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); i += 3)
    largest = std::max(
        largest, std::hypot(double{a[i]} - b[i], double{a[i + 1]} - b[i + 1], double{a[i + 2]} - b[i + 2]));
  return largest;
}

TEST_F(MotionCommands, DecodeWithinPromisedError) {
  const nlohmann::json summary = roundTrip({"--max-error", "0.0007"});
  const MotionContent back = readMotion(frames_);
  ASSERT_EQ(back.shape.columns, kShape.columns);
  ASSERT_EQ(back.shape.rows, kShape.rows);
  ASSERT_EQ(back.shape.frames, kShape.frames);
  ASSERT_EQ(back.floats.size(), content_.floats.size());
  double largest = 0;
  std::vector<float> normals(3 * kShape.vertexCount());
  for (std::uint32_t frame = 0; frame < kShape.frames; ++frame) {
    largest = std::max(largest, largestDistance(content_.positions(frame), back.positions(frame)));
    codec::computeVertexNormals({.cloths = {kShape.cloth()}}, back.positions(frame).data(), normals.data());
    EXPECT_LT(largestDistance(normals, back.normals(frame)), 1e-6) << frame;
  }
  EXPECT_LE(largest, std::sqrt(3.0) * 0.0007);
  EXPECT_GT(largest, 0.0002) << "the encoder uses the allowed error to save bits";
  EXPECT_NEAR(summary.at("measuredMaxErrorMm").get<double>(), 1e3 * largest, 1e-6);
  EXPECT_EQ(summary.at("fileBytes"), std::filesystem::file_size(stream_));
  EXPECT_EQ(summary.at("keyFrames"), 1);
  EXPECT_LT(std::filesystem::file_size(stream_), std::filesystem::file_size(motion_) / 8);
  EXPECT_THAT(filesThere(), ::testing::ElementsAre("frames", "motion", "stream"));
}

TEST_F(MotionCommands, KeepSideOfNormals) {
  for (std::uint32_t frame = 0; frame < kShape.frames; ++frame)
    for (std::size_t i = 0; i < 3 * kShape.vertexCount(); ++i)
      content_.floats[(2 * frame + 1) * std::size_t{3} * kShape.vertexCount() + i] *= -1;
  writeMotion(content_, motion_);
  roundTrip();
  const MotionContent back = readMotion(frames_);
  for (std::uint32_t frame = 0; frame < kShape.frames; ++frame) {
    double sum = 0;
    for (std::size_t i = 0; i < content_.normals(frame).size(); ++i)
      sum += double{content_.normals(frame)[i]} * back.normals(frame)[i];
    EXPECT_GT(sum, 0.5 * kShape.vertexCount()) << frame;
  }
}

TEST_F(MotionCommands, ScaleQualityWithEdgesOfFirstFrame) {
  const double edgeMm = 1e3 * meanEdge(kShape, content_.positions(0));
  EXPECT_NEAR(roundTrip().at("maxErrorMm").get<double>(), 0.025 * edgeMm, 1e-4);
  EXPECT_NEAR(roundTrip({"--quality", "standard"}).at("maxErrorMm").get<double>(), 0.025 * edgeMm, 1e-4);
  const nlohmann::json fine = roundTrip({"--quality", "fine"}), coarse = roundTrip({"--quality", "coarse"});
  EXPECT_NEAR(fine.at("maxErrorMm").get<double>(), 0.0125 * edgeMm, 1e-4);
  EXPECT_NEAR(coarse.at("maxErrorMm").get<double>(), 0.05 * edgeMm, 1e-4);
  EXPECT_LT(coarse.at("bitsPerVertex").get<double>(), fine.at("bitsPerVertex").get<double>());
}

TEST_F(MotionCommands, SetRequestedKeyFrames) {
  EXPECT_EQ(roundTrip({"--key-every", "16"}).at("keyFrames"), 3);
  auto recording = RecordingReader::open(stream_);
  ASSERT_TRUE(recording) << recording.error();
  for (std::uint32_t frame = 0; frame < kShape.frames; ++frame) {
    const auto packet = recording->next();
    ASSERT_TRUE(packet) << packet.error();
    const auto parsed = codec::parsePacket(packet->packet());
    ASSERT_TRUE(parsed);
    EXPECT_EQ(parsed->header.kind == codec::PacketKind::key, frame % 16 == 0) << frame;
  }
}

TEST_F(MotionCommands, AcceptTinyCloths) {
  for (const MotionShape shape : {MotionShape{2, 1, 3}, MotionShape{1, 9, 1}, MotionShape{3, 2, 5}}) {
    content_ = waves(shape);
    writeMotion(content_, motion_);
    roundTrip();
    const MotionContent back = readMotion(frames_);
    ASSERT_EQ(back.floats.size(), content_.floats.size());
    EXPECT_LT(largestDistance(content_.positions(0), back.positions(0)), 0.05);
  }
  content_ = waves({1, 1, 2});
  writeMotion(content_, motion_);
  const Result refused = clothstream({"encode", motion_, stream_});
  EXPECT_EQ(refused.code, kUnreadable);
  EXPECT_THAT(refused.errors, HasSubstr("give --max-error"));
  roundTrip({"--max-error", "0.001"});
  EXPECT_EQ(readMotion(frames_).shape.frames, 2u);
}

TEST_F(MotionCommands, PrintSummary) {
  const Result encoded = clothstream({"encode", motion_, stream_, "--max-error", "0.001"});
  EXPECT_EQ(encoded.code, 0);
  EXPECT_THAT(encoded.output,
              AllOf(HasSubstr("24x17 vertices, 40 frames"), HasSubstr("bits a vertex a frame"),
                    HasSubstr("1 key frame"), HasSubstr("promised 1.732 mm")));
  EXPECT_THAT(encoded.errors, IsEmpty()) << "progress is shown only on a terminal";
}

TEST_F(MotionCommands, RefuseInvalidArguments) {
  for (const std::vector<std::string>& arguments : std::vector<std::vector<std::string>>{
           {"encode", motion_},
           {"encode", motion_, stream_, "--quality", "great"},
           {"encode", motion_, stream_, "--quality", "fine", "--max-error", "0.001"},
           {"encode", motion_, stream_, "--max-error", "0"},
           {"encode", motion_, stream_, "--max-error", "1e-9"},
           {"encode", motion_, stream_, "--max-error", "nan"},
           {"encode", motion_, stream_, "--max-error", "1e6"},
           {"encode", motion_, stream_, "--layers", "2"},
           {"encode", motion_, stream_, "--key-every", "-1"},
           {"encode", motion_, motion_},
           {"decode", motion_}}) {
    const Result result = clothstream(arguments);
    EXPECT_EQ(result.code, kUsage) << ::testing::PrintToString(arguments) << result.errors;
    EXPECT_THAT(result.errors, ::testing::Not(IsEmpty()));
  }
  EXPECT_THAT(filesThere(), ::testing::ElementsAre("motion"));
}

TEST_F(MotionCommands, RefuseInvalidMotionFiles) {
  const auto refused = [&](const std::string& reason) {
    const Result result = clothstream({"encode", motion_, stream_});
    EXPECT_EQ(result.code, kUnreadable) << reason;
    EXPECT_THAT(result.errors, HasSubstr(reason));
    EXPECT_FALSE(std::filesystem::exists(stream_));
  };
  std::filesystem::resize_file(motion_, std::filesystem::file_size(motion_) - 1);
  refused("40 frames of 24x17 vertices need");
  content_.floats.back() = 1;
  content_.floats[2 * 3 * kShape.vertexCount() * std::size_t{30}] = std::numeric_limits<float>::infinity();
  writeMotion(content_, motion_);
  refused("in frame 30 (of 0 to 39), vertex 0 has the coordinate inf");
  content_.floats[2 * 3 * kShape.vertexCount() * std::size_t{30}] = 1e6f;
  writeMotion(content_, motion_);
  refused("vertex 0 has a coordinate of 1000000 m");
  content_.shape.columns = 0;
  writeMotion(content_, motion_);
  refused("its header has 0 columns");
  std::ofstream(motion_) << "text";
  refused("it has 4 bytes");
  std::filesystem::remove(motion_);
  refused("No such file");
  EXPECT_THAT(filesThere(), IsEmpty());
}

TEST_F(MotionCommands, EncodeWhatTheFormatReaches) {
  // 514.2 m at 0.5 mm. Beyond 16 m the rounding of float32 adds to the promise.
  const auto moveTo = [&](float x) {
    content_.floats[2 * 3 * kShape.vertexCount() * std::size_t{30}] = x;
    writeMotion(content_, motion_);
  };
  moveTo(-514.2f);
  const nlohmann::json summary = roundTrip({"--max-error", "0.0005"});
  EXPECT_NEAR(summary.at("promisedMaxErrorMm").get<double>(), 0.969, 0.001);
  EXPECT_NEAR(readMotion(frames_).positions(30)[0], -514.2, 0.001);
  std::filesystem::remove(stream_);
  moveTo(-514.3f);
  const Result refused = clothstream({"encode", motion_, stream_, "--max-error", "0.0005"});
  EXPECT_EQ(refused.code, kUnreadable);
  EXPECT_THAT(refused.errors, AllOf(HasSubstr("in frame 30, vertex 0 has a coordinate of -514.3 m"),
                                    HasSubstr("Use a max error of 0.000501 m or more")));
  EXPECT_FALSE(std::filesystem::exists(stream_));
}

TEST_F(MotionCommands, RefuseInvalidStreamFiles) {
  const auto refused = [&](const std::string& bytes, const std::string& reason) {
    std::ofstream(stream_, std::ios::binary) << bytes;
    const Result result = clothstream({"decode", stream_, frames_});
    EXPECT_EQ(result.code, kUnreadable) << reason;
    EXPECT_THAT(result.errors, HasSubstr(reason));
  };
  ASSERT_EQ(clothstream({"encode", motion_, stream_}).code, 0);
  const std::string whole = streamBytes();
  refused(whole.substr(0, whole.size() - 1), "frame 39 (of 0 to 39) cannot be read");
  refused(whole + "more", "there are bytes after its 40 frames");
  refused("clothstream\n", "it ends in its header");
  refused(std::string(100, 'x'), "is not a file of clothstream encode");
  refused("", "is not a file of clothstream encode");
  const Result ofAMotion = clothstream({"decode", motion_, frames_});
  EXPECT_EQ(ofAMotion.code, kUnreadable);
  EXPECT_THAT(ofAMotion.errors, HasSubstr("is not a file of clothstream encode"));
  std::filesystem::remove(stream_);
  EXPECT_EQ(clothstream({"decode", stream_, frames_}).code, kUnreadable);
  EXPECT_THAT(filesThere(), ::testing::ElementsAre("motion"));
}

TEST_F(MotionCommands, RefuseStreamsWithTooManyVertices) {
  ASSERT_EQ(clothstream({"encode", motion_, stream_}).code, 0);
  const auto decoded = [&](std::uint32_t maxVertices) {
    return clothstream({"decode", stream_, frames_, "--max-vertices", std::to_string(maxVertices)});
  };
  const Result refused = decoded(kShape.vertexCount() - 1);
  EXPECT_EQ(refused.code, kUnreadable);
  EXPECT_THAT(refused.errors, HasSubstr("has 408 vertices; at most 407 are allowed (--max-vertices)"));
  EXPECT_FALSE(std::filesystem::exists(frames_));
  EXPECT_EQ(decoded(kShape.vertexCount()).code, 0);
}

TEST_F(MotionCommands, DetectEveryDamagedPacket) {
  ASSERT_EQ(clothstream({"encode", motion_, stream_}).code, 0);
  const std::string whole = streamBytes();
  for (std::size_t at = 60; at < whole.size(); at += whole.size() / 23) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    std::ofstream(stream_, std::ios::binary) << damaged;
    const Result result = clothstream({"decode", stream_, frames_});
    EXPECT_EQ(result.code, kUnreadable) << at;
    EXPECT_THAT(result.errors, HasSubstr("is broken")) << at;
    EXPECT_THAT(filesThere(), ::testing::ElementsAre("motion", "stream"));
  }
}

TEST_F(MotionCommands, LeaveNoFileWhenResultCannotBeWritten) {
  ASSERT_EQ(clothstream({"encode", motion_, stream_}).code, 0);
  const std::string before = streamBytes();
  const auto limited = [](const std::vector<std::string>& arguments) {
    std::vector<std::string> command{"/bin/sh", "-c", "ulimit -f 1; exec \"$@\"", "sh", CLOTHSTREAM};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return run(command);
  };
  for (const Result& result :
       {limited({"encode", motion_, stream_}), limited({"decode", stream_, frames_}),
        clothstream({"encode", motion_, "/missing/stream"}),
        clothstream({"decode", stream_, "/missing/frames"}), clothstream({"encode", motion_, "/dev/null"}),
        clothstream({"decode", stream_, stream_.parent_path()})}) {
    EXPECT_EQ(result.code, kNotWritten) << result.errors;
    EXPECT_THAT(result.errors, HasSubstr("cannot write"));
  }
  EXPECT_EQ(streamBytes(), before) << "the old file stays";
  EXPECT_THAT(filesThere(), ::testing::ElementsAre("motion", "stream"));
}

TEST_F(MotionCommands, LeaveNoFileWhenInterrupted) {
  // Too long to finish in time. The file is sparse and reads as zeros, so --max-error is needed.
  MotionContent still{{.columns = 300, .rows = 300, .frames = 3000}, {}};
  writeMotion(still, motion_);
  std::filesystem::resize_file(motion_, 16 + std::uint64_t{24} * 300 * 300 * 3000);
  for (const int signal : {SIGINT, SIGTERM}) {
    Process process({CLOTHSTREAM, "encode", motion_, stream_, "--max-error", "0.001"});
    while (filesThere().size() < 2 && !process.waitForEnd(10ms)) {
    }
    process.signal(signal);
    EXPECT_EQ(process.waitForEnd(kEnd), kNotWritten);
    EXPECT_THAT(process.errors(), HasSubstr("interrupted in frame"));
    EXPECT_THAT(filesThere(), ::testing::ElementsAre("motion"));
  }
}

}  // namespace
}  // namespace clothstream::files
