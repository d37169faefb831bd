// SPDX-License-Identifier: MIT
// Tests of the programs: `clothstream record`, `info` and `recover`, `clothstream-server --record` and
// `resimulate`.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/grpc/grpc_client.h"
#include "clothstream/v1/recording.pb.h"
#include "proto/recording/recording_writer.h"
#include "tests/e2e/process.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/recording/sample.h"

namespace clothstream::recording {
namespace {

using namespace std::chrono_literals;
using e2e::Process;
using ::testing::HasSubstr;

// Long enough for sanitizers, validation and software Vulkan on a busy machine.
constexpr auto kPatience = 60s;

struct Ended {
  int code = -1;
  std::string output, errors;
};

Ended run(const std::vector<std::string>& command) {
  Process process(command);
  const std::optional<int> code = process.waitForEnd(kPatience);
  return {code.value_or(-1), process.output(), process.errors()};
}

class RecordingPrograms : public ::testing::Test {
 protected:
  // Starts a server with the scene "small".
  void startServer(std::vector<std::string> options = {}) {
    options.insert(options.begin(), {CLOTHSTREAM_SERVER, "--port", "0", "--grpc-port", "0", "--scene",
                                     "small", "--scene-file", "tests/e2e/small.json"});
    server_ = std::make_unique<Process>(options);
    if (const auto line = server_->waitForLine("gRPC ", kPatience)) {
      address_ = line->substr(line->find_first_not_of(' '));
      return;
    }
    server_->waitForEnd(kPatience);
    if (server_->errors().find("no Vulkan") != std::string::npos) GTEST_SKIP() << server_->errors();
    FAIL() << "the server did not start: " << server_->errors();
  }

  std::string pathOf(const char* name) const { return (directory_.path() / name).string(); }
  Ended clothstream(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), CLOTHSTREAM);
    return run(arguments);
  }
  std::string serversRecording(const char* directory = "recordings") const {
    for (const auto& entry : std::filesystem::directory_iterator(directory_.path() / directory))
      return entry.path().string();
    return {};
  }
  // Kills a server that records to `directory` shortly before its next chunk is due. Returns the tick of the
  // last frame that a client got.
  void killAfterAChunk(const char* directory, std::uint64_t& tick) {
    std::atomic<std::uint64_t> seen = 0;
    NativeClientOptions options;
    options.reconnectFor = 0ms;
    const auto client = joinByGrpc(address_, options, [&](cs_client* joined, std::uint32_t events) {
      if ((events & CS_EVENT_FRAME) == 0) return;
      cs_statistics now;
      cs_get_statistics(joined, NativeClient::nowUs(), &now);
      seen = now.tick;
    });
    ASSERT_TRUE(client.has_value()) << client.error().text;
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    const auto waitForBytes = [&](std::uintmax_t least) {
      std::error_code none;
      while (serversRecording(directory).empty() ||
             std::filesystem::file_size(serversRecording(directory), none) < least) {
        ASSERT_LT(std::chrono::steady_clock::now(), deadline);
        std::this_thread::sleep_for(20ms);
      }
    };
    // Schemas come first, then chunks.
    ASSERT_NO_FATAL_FAILURE(waitForBytes(1));
    std::this_thread::sleep_for(20ms);
    const std::uintmax_t schemas = std::filesystem::file_size(serversRecording(directory));
    ASSERT_NO_FATAL_FAILURE(waitForBytes(schemas + 10'000));
    // A chunk was closed just before.
    std::this_thread::sleep_for(170ms);
    server_->signal(SIGKILL);
    server_->waitForEnd(kPatience);
    while (!(*client)->ended()) {
      ASSERT_LT(std::chrono::steady_clock::now(), deadline);
      (*client)->wait(100ms);
    }
    tick = seen;
  }

  e2e::TemporaryDirectory directory_;
  std::unique_ptr<Process> server_;
  std::string address_;
};

TEST_F(RecordingPrograms, RecordAStreamCompletelyWithKeyFrames) {
  startServer();
  if (IsSkipped() || HasFatalFailure()) return;
  const std::string path = pathOf("stream.mcap");
  const Ended recorded = clothstream({"record", "small", "-o", path, "--server", address_, "--seconds", "3"});
  ASSERT_EQ(recorded.code, 0) << recorded.errors;
  const Ended info = clothstream({"info", path});
  EXPECT_EQ(info.code, 0) << info.output << info.errors;
  EXPECT_THAT(info.output, HasSubstr("; 0 cannot be decoded; 0 differ from the server's"));
  EXPECT_THAT(info.output, HasSubstr("all checksums match"));
  const std::string quick = clothstream({"info", "--quick", path}).output;
  EXPECT_THAT(quick, HasSubstr("index     complete"));
  EXPECT_THAT(quick, HasSubstr("frames of quality 0, 1, 2, 3"));
  EXPECT_THAT(clothstream({"info", "--quick", "--json", path}).output, Not(HasSubstr("whole")));
  EXPECT_THAT(clothstream({"info", "--json", path}).output, HasSubstr("\"whole\": true"));

  auto reader = RecordingReader::open(path);
  ASSERT_TRUE(reader.has_value()) << reader.error();
  std::size_t frames = 0, sinceKey = 0, farthest = 0;
  for (auto message = reader->next(); *message; message = reader->next()) {
    if ((*message)->topic != Topic::frames) continue;
    sinceKey = isKeyFrame((*message)->bytes) ? 0 : sinceKey + 1;
    farthest = std::max(farthest, sinceKey);
    ++frames;
  }
  EXPECT_GT(frames, 30u);
  EXPECT_LT(farthest, kMaxKeyFrameDistance);

  const Ended again = clothstream({"record", "-o", path, "--server", address_, "--seconds", "1"});
  EXPECT_EQ(again.code, 6);
  EXPECT_THAT(again.errors, HasSubstr("File exists"));
  const Ended unknown = clothstream({"record", "none", "-o", pathOf("none"), "--server", address_});
  EXPECT_EQ(unknown.code, 4);
  EXPECT_FALSE(std::filesystem::exists(pathOf("none")));
  const Ended simulated = run({CLOTHSTREAM_SERVER, "resimulate", path});
  EXPECT_EQ(simulated.code, 7);
  EXPECT_THAT(simulated.errors, HasSubstr("it holds no simulation"));
}

TEST_F(RecordingPrograms, InterruptCompletesRecordings) {
  startServer({"--always-run", "--record", pathOf("recordings")});
  if (IsSkipped() || HasFatalFailure()) return;
  const std::string path = pathOf("stream.mcap");
  Process record({CLOTHSTREAM, "record", "-o", path, "--server", address_});
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  std::error_code none;
  while (std::filesystem::file_size(path, none) < 250'000 || none) {
    ASSERT_LT(std::chrono::steady_clock::now(), deadline);
    std::this_thread::sleep_for(20ms);
  }
  record.signal(SIGINT);
  EXPECT_EQ(record.waitForEnd(kPatience), 0) << record.errors();
  EXPECT_EQ(clothstream({"info", path}).code, 0);
  server_->signal(SIGTERM);
  EXPECT_EQ(server_->waitForEnd(kPatience), 0);
  EXPECT_THAT(server_->output(), HasSubstr("recordings"));
  const Ended info = clothstream({"info", serversRecording()});
  EXPECT_EQ(info.code, 0) << info.output;
  const Ended again = run({CLOTHSTREAM_SERVER, "resimulate", serversRecording()});
  EXPECT_EQ(again.code, 0) << again.output << again.errors;
  EXPECT_THAT(again.output, HasSubstr("all bit-identical"));

  const std::string holes = pathOf("holes.mcap");
  std::ifstream file(serversRecording(), std::ios::binary);
  std::ofstream(holes, std::ios::binary)
      << withFrames({std::istreambuf_iterator<char>(file), {}}, [](std::size_t frame, v1::Frame& changed) {
           if (frame == 3) changed.set_packet("garbage");
         });
  const Ended missing = run({CLOTHSTREAM_SERVER, "resimulate", holes});
  EXPECT_EQ(missing.code, 10) << missing.output << missing.errors;
  EXPECT_THAT(missing.output, HasSubstr("cannot be decoded, the first is that of an unknown tick"));
}

// A killed server can lose only the chunk that is not closed. So no chunk may be longer than promised, and a
// client may have seen at most as many ticks beyond the recording as two chunks hold. One of three runs must
// achieve that, since a busy machine may delay the writer's thread.
TEST_F(RecordingPrograms, KilledServerLosesAtMostItsLastChunk) {
  constexpr double kPromised = 0.25;  // s
  double leastChunksLost = std::numeric_limits<double>::infinity();
  std::string path;
  for (const char* name : {"first", "second", "third"}) {
    startServer({"--always-run", "--record", pathOf(name)});
    if (IsSkipped() || HasFatalFailure()) return;
    std::uint64_t seen = 0;
    ASSERT_NO_FATAL_FAILURE(killAfterAChunk(name, seen));
    path = serversRecording(name);
    auto cut = RecordingReader::open(path, CutFiles::read);
    ASSERT_TRUE(cut.has_value()) << cut.error();
    for (const ChunkPlace& chunk : cut->mcap().chunks())
      EXPECT_LE(static_cast<double>(chunk.end - chunk.start) * 1e-9, kPromised);
    const std::span<const ChunkPlace> chunks = cut->mcap().chunks();
    std::vector<std::uint64_t> ticksInChunk(chunks.size());
    std::uint64_t lastTick = 0;
    v1::RecordedTick tick;
    for (auto message = cut->next(); message && *message; message = cut->next()) {
      if ((*message)->topic != Topic::ticks) continue;
      ASSERT_TRUE(tick.ParseFromArray((*message)->bytes.data(), static_cast<int>((*message)->bytes.size())));
      lastTick = tick.tick();
      for (std::size_t i = 0; i < chunks.size(); ++i)
        ticksInChunk[i] += chunks[i].start <= (*message)->time && (*message)->time <= chunks[i].end ? 1 : 0;
    }
    const std::uint64_t mostTicks = *std::ranges::max_element(ticksInChunk);
    ASSERT_GT(mostTicks, 0u);
    const double ticksLost = static_cast<double>(seen) - static_cast<double>(lastTick);
    std::printf("killed: %.0f ticks lost; a chunk holds up to %lu\n", ticksLost, mostTicks);
    leastChunksLost = std::min(leastChunksLost, ticksLost / static_cast<double>(mostTicks));
  }
  EXPECT_LE(leastChunksLost, 2);

  const std::string whole = pathOf("whole.mcap");
  const Ended damaged = clothstream({"info", path});
  EXPECT_EQ(damaged.code, 7);
  EXPECT_THAT(damaged.output, HasSubstr("run clothstream recover"));
  EXPECT_THAT(run({CLOTHSTREAM_SERVER, "resimulate", path}).errors, HasSubstr("clothstream recover"));
  const Ended recovered = clothstream({"recover", path, whole});
  EXPECT_EQ(recovered.code, 0) << recovered.errors;
  EXPECT_EQ(clothstream({"info", whole}).code, 0);
  const Ended again = run({CLOTHSTREAM_SERVER, "resimulate", whole});
  EXPECT_EQ(again.code, 0) << again.output << again.errors;
}

TEST_F(RecordingPrograms, RecoverReportsTheLoss) {
  const std::string path = pathOf("damaged.mcap"), out = pathOf("out.mcap");
  std::string bytes = sampleRecording(150);
  const ChunkPlace fifth = readerOf(bytes).mcap().chunks()[5];
  bytes[fifth.offset + fifth.length / 2] = static_cast<char>(bytes[fifth.offset + fifth.length / 2] ^ 1);
  std::ofstream(path, std::ios::binary) << bytes;
  const Ended info = clothstream({"info", path});
  EXPECT_EQ(info.code, 7);
  EXPECT_THAT(info.output, HasSubstr("damaged   the chunk at byte"));
  const Ended recovered = clothstream({"recover", path, out});
  EXPECT_EQ(recovered.code, 7);
  EXPECT_THAT(recovered.errors, HasSubstr("1 damaged chunks"));
  auto reader = RecordingReader::open(out);
  ASSERT_TRUE(reader.has_value()) << reader.error();
  EXPECT_TRUE(reader->check().has_value());
  EXPECT_EQ(countMessages(*reader, Topic::frames), 138u);  // a fifth of a second is missing
  EXPECT_EQ(clothstream({"recover", path, out}).code, 6);  // the file exists already
}

// Files that are whole for every checksum, but whose packets are not.
TEST_F(RecordingPrograms, EveryReaderFailsAtFramesThatCannotBeDecoded) {
  const std::string whole = sampleRecording(kSampleFrames);
  std::filesystem::create_directory(pathOf("golden"));
  const std::string good = pathOf("good.mcap"), out = pathOf("out.mcap"),
                    garbage = pathOf("golden/garbage.mcap"), holes = pathOf("holes.mcap"),
                    different = pathOf("different.mcap");
  std::ofstream(good, std::ios::binary) << whole;
  std::ofstream(garbage, std::ios::binary) << withGarbage(whole);
  std::ofstream(holes, std::ios::binary) << withFrames(whole, [](std::size_t frame, v1::Frame& changed) {
    if (frame == 30) changed.set_packet("garbage");
  });
  std::ofstream(different, std::ios::binary) << withFrames(whole, [](std::size_t frame, v1::Frame& changed) {
    if (frame == 30) changed.set_reconstruction_hash(changed.reconstruction_hash() ^ 1);
  });
  const char* const all =
      "of 150 frames 150 cannot be decoded, the first is that of an unknown tick at 0.000 s";
  const char* const some = "of 150 frames 18 cannot be decoded, the first is that of";
  const char* const wrong =
      "of 150 frames 17 cannot be decoded and 1 differ from their recorded hash, the first is that of tick "
      "31";
  for (const auto& [path, faults] :
       {std::pair(garbage, all), std::pair(holes, some), std::pair(different, wrong)}) {
    const Ended info = clothstream({"info", path});
    EXPECT_EQ(info.code, 7);
    EXPECT_THAT(info.output, HasSubstr(faults));
    EXPECT_THAT(info.output, ::testing::Not(HasSubstr("all checksums match")));
    EXPECT_THAT(clothstream({"info", "--json", path}).output, HasSubstr("\"whole\": false"));
    for (const char* format : {"frames.npz", "frames.glb", "frames"}) {
      const Ended exported = clothstream({"export", path, pathOf(format)});
      EXPECT_EQ(exported.code, 7) << format;
      EXPECT_THAT(exported.errors, HasSubstr(faults));
      EXPECT_FALSE(std::filesystem::exists(pathOf(format))) << format;
    }
    const Ended measured = clothstream({"measure", path, "--json"});
    EXPECT_EQ(measured.code, 7);
    EXPECT_THAT(measured.errors, HasSubstr(faults));
    const Ended compared = clothstream({"diff", path, good});
    EXPECT_EQ(compared.code, 10) << compared.output;
    EXPECT_THAT(compared.output, HasSubstr(faults));
    const Ended played =
        run({CLOTHSTREAM_SERVER, "--port", "0", "--grpc-port", "0", "play", path, "--lockstep"});
    EXPECT_EQ(played.code, 1);
    EXPECT_THAT(played.errors, HasSubstr(faults));
    const Ended recovered = clothstream({"recover", path, out});
    EXPECT_EQ(recovered.code, 7);
    EXPECT_THAT(recovered.errors, HasSubstr(faults));
    EXPECT_THAT(recovered.output, HasSubstr("verified, but not complete"));
    const Ended result = clothstream({"info", out});
    EXPECT_EQ(result.code, 0) << result.output;
    std::filesystem::remove(out);
  }
  Process player({CLOTHSTREAM_SERVER, "--port", "0", "--grpc-port", "0", "play", holes, "--speed", "8"});
  const auto line = player.waitForLine("gRPC ", kPatience);
  ASSERT_TRUE(line) << player.errors();
  const Ended joined = clothstream({"join", line->substr(line->find_first_not_of(' ')), "--seconds", "1"});
  EXPECT_EQ(joined.code, 0) << joined.errors;
  player.signal(SIGINT);
  EXPECT_EQ(player.waitForEnd(kPatience), 7);
  EXPECT_THAT(player.errors(), HasSubstr("frames 18 cannot be decoded, the first is that of"));
  EXPECT_EQ(clothstream({"golden", pathOf("golden"), "--update"}).code, 7);
  EXPECT_THAT(run({CLOTHSTREAM_SERVER, "--port", "0", "--grpc-port", "0", "play", garbage}).errors,
              HasSubstr(all));
}

TEST_F(RecordingPrograms, RefuseMoreVerticesThanAllowed) {
  const std::string path = pathOf("sample.mcap");
  std::ofstream(path, std::ios::binary) << sampleRecording(3);
  const std::vector<std::vector<std::string>> commands{
      {"info", path},
      {"export", path, pathOf("frames.npz")},
      {"measure", path},
      {"measure", pathOf("frames.npz")},
      {"import", pathOf("frames.npz"), "-o", pathOf("in.mcap")},
      {"recover", path, pathOf("out.mcap")},
      {"diff", path, path}};
  for (std::vector<std::string> command : commands) {
    command.insert(command.end(), {"--max-vertices", "41"});
    const Ended refused = clothstream(command);
    const std::string& file = command[1];
    EXPECT_EQ(refused.code, 7) << command[0] << ' ' << file;
    EXPECT_THAT(refused.output + refused.errors,
                HasSubstr(file.ends_with(".npz") ? "1 to 41 vertices (--max-vertices)" : "42 vertices"))
        << command[0] << ' ' << file;
    command.back() = "42";
    const Ended accepted = clothstream(command);
    EXPECT_EQ(accepted.code, 0) << command[0] << ' ' << file << ": " << accepted.errors;
  }
  EXPECT_THAT(run({CLOTHSTREAM_SERVER, "play", path, "--max-vertices", "41"}).errors,
              HasSubstr("42 vertices; at most 41"));
  EXPECT_THAT(run({CLOTHSTREAM_SERVER, "resimulate", "--help"}).output, HasSubstr("--max-vertices"));
}

TEST_F(RecordingPrograms, SayWhichQualityARecordingHolds) {
  const std::string source = pathOf("coarse.mcap"), kept = pathOf("kept.mcap"), full = pathOf("full.mcap");
  std::ofstream(source, std::ios::binary) << withCoarseFrames(sampleRecording(kSampleFrames), 48);
  EXPECT_THAT(clothstream({"info", source}).output,
              HasSubstr("48 frames of quality 0, 102 frames of quality 1"));
  // Interrupts the recording when the file has this many frames; 0: waits for its end.
  const auto record = [&](const std::string& path, std::size_t frames, const char* option) -> Ended {
    Process server({CLOTHSTREAM_SERVER, "--port", "0", "--grpc-port", "0", "play", source, "--lockstep",
                    "--speed", "max"});
    const auto line = server.waitForLine("gRPC ", kPatience);
    if (!line) return {-1, server.output(), server.errors()};
    std::vector<std::string> command{CLOTHSTREAM, "record",   "-o",
                                     path,        "--server", line->substr(line->find_first_not_of(' '))};
    if (option != nullptr) command.emplace_back(option);
    Process process(command);
    const auto inFile = [&]() -> std::size_t {
      auto reader = RecordingReader::open(path, CutFiles::read);
      return reader ? countMessages(*reader, Topic::frames) : 0;
    };
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (inFile() < frames && std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(20ms);
    if (frames > 0) process.signal(SIGINT);
    const std::optional<int> code = process.waitForEnd(kPatience);
    return {code.value_or(-1), process.output(), process.errors()};
  };
  const Ended recorded = record(kept, kSampleFrames, nullptr);
  EXPECT_EQ(recorded.code, 0) << recorded.errors;
  EXPECT_THAT(recorded.output, HasSubstr("102 of 150 frames are coarser than quality 0"));
  EXPECT_THAT(recorded.output, HasSubstr("102 of quality 1"));
  EXPECT_THAT(clothstream({"info", "--quick", kept}).output,
              HasSubstr("quality   48, 102, 0, 0 frames of quality 0, 1, 2, 3"));
  EXPECT_THAT(clothstream({"info", "--json", kept}).output,
              HasSubstr("\"frames_of_quality\": \"48, 102, 0, 0\""));

  const Ended insisted = record(full, 0, "--full-quality");
  EXPECT_EQ(insisted.code, 5);
  EXPECT_THAT(insisted.errors, HasSubstr("the server lowered the quality after 48 frames"));
  const Ended info = clothstream({"info", full});
  EXPECT_EQ(info.code, 0) << info.output;
  EXPECT_THAT(info.output, HasSubstr("quality   48 frames of quality 0\n"));
}

// A hostile server, here one that plays a hostile file.
TEST_F(RecordingPrograms, EscapeControlCharactersInLinesOfEvents) {
  const std::string path = pathOf("hostile.mcap"), hostile =
                                                       "a\x1b[2J\xc2\x9b"
                                                       "1m\xe2\x80\xae"
                                                       "b\xe2\x80\x8b";
  std::string bytes;
  auto writer = RecordingWriter::begin(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      "test", {{"scene", "sample"}, {"device", hostile}});
  RecordingReader reader = readerOf(sampleRecording(30));
  for (auto message = reader.next(); *message; message = reader.next()) {
    ASSERT_TRUE(writer->write((*message)->topic, (*message)->time, (*message)->bytes));
    v1::Notice notice;
    notice.set_kind(v1::NOTICE_KIND_SCENE_RESET);
    notice.set_text(hostile);
    ASSERT_TRUE(writer->write(Topic::notices, (*message)->time, notice.SerializeAsString()));
  }
  ASSERT_TRUE(writer->finish());
  std::ofstream(path, std::ios::binary) << bytes;
  Process server(
      {CLOTHSTREAM_SERVER, "--port", "0", "--grpc-port", "0", "play", path, "--lockstep", "--speed", "max"});
  const auto line = server.waitForLine("gRPC ", kPatience);
  ASSERT_TRUE(line) << server.errors();
  const std::string address = line->substr(line->find_first_not_of(' '));
  Process joined({CLOTHSTREAM, "join", address, "--events"});
  EXPECT_TRUE(joined.waitForOutput("\\u001b[2J\\u009b1m\\u202eb\\u200b", kPatience)) << joined.output();
  joined.signal(SIGINT);
  EXPECT_EQ(joined.waitForEnd(kPatience), 0) << joined.errors();
  EXPECT_THAT(joined.errors(), HasSubstr("\\x1b[2J\\xc2\\x9b1m\\xe2\\x80\\xaeb"));
  const Ended shown = clothstream({"join", address, "--seconds", "0.5"});
  for (const std::string& text :
       {joined.output(), joined.errors(), shown.output, shown.errors, server.output()})
    for (const char* control : {"\x1b", "\xc2\x9b", "\xe2\x80\xae", "\xe2\x80\x8b"})
      EXPECT_THAT(text, ::testing::Not(HasSubstr(control)));
}

TEST_F(RecordingPrograms, EscapeControlCharactersOfOtherPrograms) {
  const std::string path = pathOf("foreign.mcap");
  std::string bytes;
  auto writer = RecordingWriter::begin(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      "test",
      {{"scene",
        "a\x1b[2J\xc2\x9b"
        "1mb"},
       {"device", "Gerät"}});
  ASSERT_TRUE(writer && writer->finish());
  std::ofstream(path, std::ios::binary) << bytes;
  const Ended info = clothstream({"info", "--quick", path});
  EXPECT_THAT(info.output, HasSubstr("scene     a\\x1b[2J\\xc2\\x9b1mb, "));
  EXPECT_THAT(info.output, HasSubstr("Gerät"));
}

// Without a device, since playing does not simulate.
TEST_F(RecordingPrograms, PlayARecordingToClients) {
  const std::string path = pathOf("sample.mcap"), again = pathOf("again.mcap");
  std::ofstream(path, std::ios::binary) << sampleRecording(150);
  server_ = std::make_unique<Process>(std::vector<std::string>{
      "/usr/bin/env", "VK_ICD_FILENAMES=/none", "VK_DRIVER_FILES=/none", CLOTHSTREAM_SERVER, "--port", "0",
      "--grpc-port", "0", "play", path, "--loop", "--from", "1"});
  const auto line = server_->waitForLine("gRPC ", kPatience);
  ASSERT_TRUE(line) << server_->errors();
  address_ = line->substr(line->find_first_not_of(' '));
  EXPECT_THAT(server_->output(), HasSubstr("2.5 s of sample, recorded on none"));

  const Ended recorded = clothstream({"record", "-o", again, "--server", address_, "--seconds", "4"});
  EXPECT_EQ(recorded.code, 0) << recorded.errors;
  const Ended info = clothstream({"info", again});
  EXPECT_EQ(info.code, 0) << info.output;
  EXPECT_THAT(info.output, HasSubstr("; 0 differ from the server's"));

  const auto control = [&](std::vector<std::string> command) {
    command.insert(command.end(), {"--server", address_});
    return clothstream(command);
  };
  EXPECT_EQ(control({"pause", "sample"}).code, 0);
  EXPECT_THAT(control({"seek", "sample", "0.5"}).output,
              HasSubstr(" s of 2.48 s, speed 1, in a loop, paused"));
  EXPECT_THAT(control({"speed", "sample", "2"}).output, HasSubstr("speed 2"));
  EXPECT_THAT(control({"loop", "sample", "off"}).output, ::testing::Not(HasSubstr("in a loop")));
  EXPECT_EQ(control({"resume", "sample"}).code, 0);
  const Ended refused = control({"seek", "sample", "3"});
  EXPECT_EQ(refused.code, 4);
  EXPECT_THAT(refused.errors, HasSubstr("seek = 3: must be 0 to 2.483"));
  EXPECT_THAT(clothstream({"set", address_, "--wind", "1,0,0"}).errors,
              HasSubstr("a recording that is played"));
  EXPECT_THAT(control({"create", "--named", "flag"}).errors, HasSubstr("there is no device"));
  EXPECT_THAT(control({"start-recording", "sample"}).errors,
              HasSubstr("startRecording: 'sample' is a recording that is played"));
  EXPECT_THAT(control({"stop-recording", "sample"}).errors,
              HasSubstr("stopRecording: 'sample' is a recording that is played"));
  server_->signal(SIGTERM);
  EXPECT_EQ(server_->waitForEnd(kPatience), 0);
}

TEST_F(RecordingPrograms, StartAndStopRecordingsForClients) {
  startServer({"--always-run", "--recordings", pathOf("recordings")});
  if (IsSkipped() || HasFatalFailure()) return;
  const auto ask = [&](std::vector<std::string> command) {
    command.insert(command.end(), {"--server", address_});
    return clothstream(command);
  };
  const Ended started = ask({"start-recording", "small", "--name", "mine"});
  EXPECT_EQ(started.code, 0) << started.errors;
  EXPECT_EQ(started.output, "mine.mcap\n");
  EXPECT_THAT(ask({"start-recording", "small"}).errors, HasSubstr("is already being recorded to mine.mcap"));
  EXPECT_THAT(ask({"start-recording", "small", "--name", "../mine"}).errors,
              HasSubstr("must be 1 to 64 characters"));
  EXPECT_THAT(ask({"start-recording", "none"}).errors, HasSubstr("there is no scene 'none'"));
  EXPECT_EQ(clothstream({"join", address_, "--seconds", "1"}).code, 0);
  const Ended stopped = ask({"stop-recording", "small"});
  EXPECT_EQ(stopped.code, 0) << stopped.errors;
  EXPECT_THAT(stopped.output, HasSubstr("mine.mcap: "));
  EXPECT_THAT(ask({"start-recording", "small", "--name", "mine"}).errors,
              HasSubstr("already exists; choose another name"));
  const Ended again = run({CLOTHSTREAM_SERVER, "resimulate", serversRecording()});
  EXPECT_EQ(again.code, 0) << again.output << again.errors;

  startServer();
  EXPECT_THAT(ask({"start-recording", "small"}).errors, HasSubstr("clothstream-server --recordings DIR"));
}

TEST_F(RecordingPrograms, RefuseFilesThatAreNoRecordings) {
  std::ofstream(pathOf("text")) << "This is a text.";
  std::ofstream(pathOf("headers"), std::ios::binary) << sampleRecording(3).substr(0, 20'000);
  for (const char* command : {"info", "recover"}) {
    for (const char* file : {"missing", "text", "headers"}) {
      std::vector<std::string> arguments{command, pathOf(file)};
      if (arguments[0] == "recover") arguments.push_back(pathOf("out"));
      const Ended ended = clothstream(arguments);
      EXPECT_EQ(ended.code, 7) << command << ' ' << file;
      EXPECT_THAT(ended.errors, HasSubstr(pathOf(file)));
      EXPECT_FALSE(std::filesystem::exists(pathOf("out")));
    }
  }
}

TEST_F(RecordingPrograms, FullDiskEndsTheClientsRecording) {
  startServer();
  if (IsSkipped() || HasFatalFailure()) return;
  const std::string path = pathOf("stream.mcap");
  // 130 KiB, in blocks of 1024 bytes, of which schemas take 33.
  const Ended recorded = run({"/bin/bash", "-c",
                              "ulimit -f 130; exec " + std::string(CLOTHSTREAM) + " record -o " + path +
                                  " --server " + address_ + " --seconds 50"});
  EXPECT_EQ(recorded.code, 6);
  EXPECT_THAT(recorded.errors, HasSubstr("File too large"));
  EXPECT_EQ(clothstream({"recover", path, pathOf("whole")}).code, 0);
}

}  // namespace
}  // namespace clothstream::recording
