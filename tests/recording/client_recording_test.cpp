// SPDX-License-Identifier: MIT
// Recordings that are read through the C interface: every frame, seeks, the journal, and hostile bytes.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <clothstream/recording.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "clothstream/v1/recording.pb.h"
#include "proto/codec/packet_header.h"
#include "proto/recording/recording_writer.h"
#include "tests/recording/sample.h"

namespace clothstream::recording {
namespace {

using ::testing::HasSubstr;
using Handle = std::unique_ptr<cs_recording, decltype(&cs_recording_close)>;

// Opens a copy that has exactly this size, so that sanitizers find a read past its end.
class Opened {
 public:
  explicit Opened(const std::string& bytes)
      : bytes_(bytes.begin(), bytes.end()),
        handle_(cs_recording_open_bytes(bytes_.data(), bytes_.size(), 0), &cs_recording_close) {
    bytes_.shrink_to_fit();
  }
  cs_recording* get() const { return handle_.get(); }
  const cs_client* client() const { return cs_recording_client(get()); }

 private:
  std::vector<std::uint8_t> bytes_;
  Handle handle_;
};

cs_recorded emptyMessage() {
  cs_recorded message{};
  return message;
}

std::vector<float> positionsOf(const cs_client* client) {
  const float* positions = cs_positions(client);
  return {positions, positions + std::size_t{3} * cs_vertex_count(client)};
}

std::string unpacked(const std::filesystem::path& path) {
  std::string bytes;
  gzFile file = gzopen(path.c_str(), "rb");
  char piece[65536];
  for (int count = 0; (count = gzread(file, piece, sizeof piece)) > 0;)
    bytes.append(piece, static_cast<std::size_t>(count));
  gzclose(file);
  return bytes;
}

std::string sampleWithSliders(std::uint32_t frames) {
  std::string bytes;
  writeSampleWithSliders(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      frames);
  return bytes;
}

float windOf(const cs_client* client) {
  cs_environment environment{};
  EXPECT_EQ(cs_get_environment(client, &environment), 1);
  return environment.wind[0];
}

TEST(ClientRecording, DecodesEveryFrameToTheRecordedHash) {
  const Opened opened(sampleRecording(kSampleFrames));
  ASSERT_EQ(cs_recording_is_open(opened.get()), 1) << cs_recording_error_text(opened.get());
  EXPECT_EQ(cs_vertex_count(opened.client()), 42u);
  EXPECT_STREQ(cs_recording_metadata(opened.get(), "scene"), "sample");
  EXPECT_STREQ(cs_recording_metadata(opened.get(), "driver"), "");
  cs_recorded message = emptyMessage();
  for (std::uint32_t frame = 0; frame < kSampleFrames; ++frame) {
    ASSERT_EQ(cs_recording_next(opened.get(), CS_RECORDED_FRAME, &message), CS_RECORDING_NEXT);
    EXPECT_EQ(message.kind, std::uint32_t{CS_RECORDED_FRAME});
    EXPECT_EQ(message.events, std::uint32_t{CS_EVENT_FRAME});
    EXPECT_EQ(message.tick, frame + 1);
    EXPECT_EQ(message.key, frame % kMaxKeyFrameDistance == 0 ? 1 : 0);
    EXPECT_NEAR(message.seconds, frame / double{kSampleRate}, 1e-8);
    EXPECT_NE(message.reconstruction_hash, 0u);
    EXPECT_EQ(cs_reconstruction_hash(opened.client()), message.reconstruction_hash);
  }
  EXPECT_EQ(cs_recording_next(opened.get(), CS_RECORDED_FRAME, &message), CS_RECORDING_END);
  EXPECT_EQ(cs_recording_next(opened.get(), CS_RECORDED_ALL, &message), CS_RECORDING_END);
}

TEST(ClientRecording, DescribesTheFile) {
  const std::string bytes = sampleRecording(kSampleFrames);
  const Opened opened(bytes);
  cs_recording_info info{};
  info.version = CS_RECORDING_INFO_VERSION + 1;
  EXPECT_EQ(cs_recording_get_info(opened.get(), &info), 0) << "the version is unknown";
  info.version = CS_RECORDING_INFO_VERSION;
  ASSERT_EQ(cs_recording_get_info(opened.get(), &info), 1);
  EXPECT_EQ(info.complete, 1);
  EXPECT_NEAR(info.seconds, (kSampleFrames - 1) / double{kSampleRate}, 1e-8);
  EXPECT_EQ(info.start_ns, kSampleStart);
  EXPECT_EQ(info.bytes, bytes.size());
  EXPECT_EQ(info.frames, kSampleFrames);
  EXPECT_EQ(info.ticks, kSampleFrames);
}

TEST(ClientRecording, SeeksToTheFrameThatPlayingGives) {
  const Opened played(sampleWithSliders(kSampleFrames)), sought(sampleWithSliders(kSampleFrames));
  struct Frame {
    cs_recorded message;
    std::vector<float> positions;
    float wind;
  };
  std::vector<Frame> frames;
  for (cs_recorded message = emptyMessage();
       cs_recording_next(played.get(), CS_RECORDED_FRAME, &message) == CS_RECORDING_NEXT;)
    frames.push_back({message, positionsOf(played.client()), windOf(played.client())});
  ASSERT_EQ(frames.size(), kSampleFrames);
  std::mt19937 random(1);
  for (int round = 0; round < 300; ++round) {
    const std::size_t index = random() % frames.size();
    const Frame& frame = frames[index];
    cs_recorded found = emptyMessage();
    if (round % 2 == 0)
      ASSERT_EQ(cs_recording_seek(sought.get(), frame.message.seconds, &found), 1);
    else
      ASSERT_EQ(cs_recording_seek_tick(sought.get(), frame.message.tick, &found), 1);
    ASSERT_EQ(found.tick, frame.message.tick) << "round " << round;
    ASSERT_EQ(found.seconds, frame.message.seconds);
    ASSERT_EQ(cs_reconstruction_hash(sought.client()), frame.message.reconstruction_hash);
    ASSERT_EQ(positionsOf(sought.client()), frame.positions);
    ASSERT_EQ(windOf(sought.client()), frame.wind);
    if (index + 1 == frames.size()) continue;
    ASSERT_EQ(cs_recording_next(sought.get(), CS_RECORDED_FRAME, &found), CS_RECORDING_NEXT);
    ASSERT_EQ(found.tick, frame.message.tick + 1) << "playing continues after the frame";
    ASSERT_EQ(cs_reconstruction_hash(sought.client()), found.reconstruction_hash);
  }
}

TEST(ClientRecording, SeeksOutsideOfTheRecording) {
  const Opened opened(sampleRecording(kSampleFrames));
  cs_recorded found = emptyMessage();
  for (const double seconds : {-1.0, -std::numeric_limits<double>::infinity(), 0.0}) {
    ASSERT_EQ(cs_recording_seek(opened.get(), seconds, &found), 1);
    EXPECT_EQ(found.tick, 1u);
  }
  for (const double seconds : {1e9, std::numeric_limits<double>::infinity()}) {
    ASSERT_EQ(cs_recording_seek(opened.get(), seconds, nullptr), 1);
    EXPECT_EQ(cs_recording_next(opened.get(), CS_RECORDED_ALL, &found), CS_RECORDING_END);
  }
  EXPECT_EQ(cs_recording_seek(opened.get(), std::nan(""), &found), 0);
  EXPECT_THAT(cs_recording_error_text(opened.get()), HasSubstr("not a number"));
  ASSERT_EQ(cs_recording_seek_tick(opened.get(), 1'000'000, &found), 1);
  EXPECT_EQ(found.tick, std::uint64_t{kSampleFrames});
  // Before the first frame the client shows the rest state, and reading starts at the first message.
  ASSERT_EQ(cs_recording_seek_tick(opened.get(), 0, &found), 1);
  EXPECT_EQ(found.kind, 0u);
  ASSERT_EQ(cs_recording_next(opened.get(), CS_RECORDED_FRAME, &found), CS_RECORDING_NEXT);
  EXPECT_EQ(found.tick, 1u);
}

TEST(ClientRecording, FollowsParticipants) {
  std::string bytes;
  auto writer = RecordingWriter::begin(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      "test", {{"scene", "sample"}});
  ASSERT_TRUE(writer->write(Topic::description, 1, sampleDescription().SerializeAsString()));
  const auto write = [&](std::uint64_t second, std::uint64_t id, v1::ParticipantEventKind kind,
                         const char* name) {
    v1::ParticipantEvent event;
    event.set_participant_id(id);
    event.set_kind(kind);
    event.set_display_name(name);
    ASSERT_TRUE(writer->write(Topic::participants, second * 1'000'000'000, event.SerializeAsString()));
  };
  write(1, 7, v1::PARTICIPANT_EVENT_KIND_JOINED, "Ann");
  write(2, 8, v1::PARTICIPANT_EVENT_KIND_JOINED, "Ben");
  write(3, 7, v1::PARTICIPANT_EVENT_KIND_LEFT, "");
  ASSERT_TRUE(writer->finish());
  const Opened opened(bytes);
  cs_recorded message = emptyMessage();
  cs_presence presence{};
  cs_participant participant{};
  for (const std::uint32_t count : {1u, 2u, 1u}) {
    ASSERT_EQ(cs_recording_next(opened.get(), CS_RECORDED_PARTICIPANT, &message), CS_RECORDING_NEXT);
    EXPECT_EQ(message.events & CS_EVENT_PRESENCE, std::uint32_t{CS_EVENT_PRESENCE});
    EXPECT_EQ(cs_participant_count(opened.client()), count);
  }
  ASSERT_EQ(cs_get_presence(opened.client(), &presence, &participant), 1);
  EXPECT_EQ(presence.kind, std::uint32_t{CS_PRESENCE_LEFT});
  EXPECT_STREQ(participant.name, "Ann") << "an event of leaving has no name";
  ASSERT_EQ(cs_recording_seek(opened.get(), 0.5, nullptr), 1);
  EXPECT_EQ(cs_participant_count(opened.client()), 0u);
}

// Recordings of servers of earlier releases.
class ReplayFile : public ::testing::TestWithParam<std::string> {};

TEST_P(ReplayFile, GivesTheRecordedHashesAndTheJournal) {
  const Opened opened(unpacked(GetParam()));
  ASSERT_EQ(cs_recording_is_open(opened.get()), 1) << cs_recording_error_text(opened.get());
  const std::uint32_t vertices = cs_vertex_count(opened.client());
  std::uint64_t frames = 0, ticks = 0, checkpoints = 0, colliders = 0, grabs = 0, changes = 0;
  std::uint64_t stateHash = 0;
  cs_recorded message = emptyMessage();
  cs_recording_result result{};
  while ((result = cs_recording_next(opened.get(), CS_RECORDED_ALL, &message)) == CS_RECORDING_NEXT) {
    std::size_t bytes = 0;
    EXPECT_NE(cs_recording_message(opened.get(), &bytes), nullptr);
    if (message.kind == CS_RECORDED_FRAME) {
      ++frames;
      ASSERT_EQ(cs_reconstruction_hash(opened.client()), message.reconstruction_hash);
      EXPECT_NE(message.state_hash, 0u);
    } else if (message.kind == CS_RECORDED_TICK) {
      cs_recorded_tick tick{};
      tick.version = CS_RECORDED_TICK_VERSION + 1;
      EXPECT_EQ(cs_recording_get_tick(opened.get(), &tick), 0) << "the version is unknown";
      tick.version = CS_RECORDED_TICK_VERSION;
      ASSERT_EQ(cs_recording_get_tick(opened.get(), &tick), 1);
      EXPECT_EQ(tick.tick, message.tick);
      EXPECT_EQ(tick.state_hash, message.state_hash);
      EXPECT_NE(tick.state_hash, stateHash) << "the cloth moves";
      stateHash = tick.state_hash;
      ++ticks;
      cs_recorded_collider collider{};
      for (std::uint32_t i = 0; cs_recording_get_collider(opened.get(), i, &collider) == 1; ++i) {
        EXPECT_LT(i, tick.collider_count);
        if (collider.participant_id == 0) continue;
        ++colliders;
        EXPECT_EQ(collider.participant_id, 7u);
        EXPECT_EQ(collider.shape, std::uint32_t{CS_SHAPE_SPHERE});
        EXPECT_FLOAT_EQ(collider.radius, 0.1f);
      }
      cs_recorded_grab grab{};
      for (std::uint32_t i = 0; cs_recording_get_grab(opened.get(), i, &grab) == 1; ++i)
        if (grab.state != CS_GRAB_STATE_FREE) ++grabs;
    } else if (message.kind == CS_RECORDED_CHECKPOINT) {
      ++checkpoints;
      std::uint32_t nodes = 0;
      std::uint64_t tick = 0;
      const float* state = cs_recording_state(opened.get(), &nodes, &tick);
      ASSERT_EQ(nodes, vertices);
      EXPECT_EQ(tick, message.tick);
      EXPECT_TRUE(
          std::all_of(state, state + std::size_t{6} * nodes, [](float x) { return std::isfinite(x); }));
    } else if (message.kind == CS_RECORDED_PARAMETERS) {
      ++changes;
    }
  }
  EXPECT_EQ(result, CS_RECORDING_END) << cs_recording_error_text(opened.get());
  cs_recording_info info{};
  ASSERT_EQ(cs_recording_get_info(opened.get(), &info), 1);
  EXPECT_EQ(frames, info.frames);
  EXPECT_EQ(ticks, info.ticks);
  EXPECT_GT(frames, 5u);
  EXPECT_GT(checkpoints, 0u);
  EXPECT_GT(colliders, 0u);
  EXPECT_GT(grabs, 0u);
  EXPECT_GT(changes, 0u);
}

std::vector<std::string> replayFiles() {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator("tests/replay"))
    if (entry.path().extension() == ".gz") files.push_back(entry.path().string());
  std::sort(files.begin(), files.end());
  return files;
}

INSTANTIATE_TEST_SUITE_P(OfEveryVersion, ReplayFile, ::testing::ValuesIn(replayFiles()),
                         [](const auto& file) {
                           std::string name = file.param.substr(std::string("tests/replay/").size());
                           name.resize(name.size() - std::string(".mcap.gz").size());
                           for (char& c : name)
                             if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
                           return name;
                         });

// Reads to the end, and returns the number of frames.
std::uint64_t readAll(const Opened& opened, bool* failed = nullptr) {
  std::uint64_t frames = 0;
  cs_recorded message = emptyMessage();
  for (int calls = 0; calls < 10'000; ++calls) {
    const cs_recording_result result = cs_recording_next(opened.get(), CS_RECORDED_ALL, &message);
    if (result == CS_RECORDING_END) return frames;
    if (result == CS_RECORDING_ERROR) {
      EXPECT_STRNE(cs_recording_error_text(opened.get()), "");
      if (failed) *failed = true;
      if (cs_recording_is_open(opened.get()) == 0 || cs_get_state(opened.client()) == CS_STATE_FAILED)
        return frames;
    } else if (message.kind == CS_RECORDED_FRAME) {
      ++frames;
      EXPECT_EQ(cs_reconstruction_hash(opened.client()), message.reconstruction_hash);
    }
  }
  ADD_FAILURE() << "the recording does not end";
  return frames;
}

TEST(ClientRecording, EndsEarlyOrFailsWhereItIsTruncated) {
  const std::string whole = sampleRecording(40);
  // Most of the file is its schemas, before the chunks and after them.
  const RecordingReader reader = readerOf(whole);
  const std::uint64_t start = reader.mcap().chunks().front().offset, end = reader.mcap().dataEnd();
  const auto step = [&](std::size_t length) { return length >= start && length < end ? 3u : 997u; };
  std::uint64_t before = 0;
  for (std::size_t length = 0; length < whole.size(); length += step(length)) {
    const Opened opened(whole.substr(0, length));
    if (cs_recording_is_open(opened.get()) == 0) {
      EXPECT_STRNE(cs_recording_error_text(opened.get()), "");
      EXPECT_EQ(cs_recording_client(opened.get()), nullptr);
      ASSERT_EQ(before, 0u) << "a longer file has at least as many frames";
      continue;
    }
    cs_recording_info info{};
    ASSERT_EQ(cs_recording_get_info(opened.get(), &info), 1);
    EXPECT_EQ(info.complete, 0);
    const std::uint64_t frames = readAll(opened);
    ASSERT_GE(frames, before);
    before = frames;
  }
  EXPECT_EQ(before, 40u) << "without its index a file still has all frames";
}

TEST(ClientRecording, ReportsADamagedChunkOnceAndContinuesAfterIt) {
  std::string bytes = sampleRecording(kSampleFrames);
  const RecordingReader reader = readerOf(bytes);
  const ChunkPlace& damaged = reader.mcap().chunks()[4];
  bytes[damaged.offset + damaged.length - 1] = static_cast<char>(~bytes[damaged.offset + damaged.length - 1]);
  const Opened opened(bytes);
  cs_recorded message = emptyMessage();
  std::uint64_t frames = 0, errors = 0;
  cs_recording_result result{};
  while ((result = cs_recording_next(opened.get(), CS_RECORDED_FRAME, &message)) != CS_RECORDING_END) {
    if (result == CS_RECORDING_ERROR) {
      ++errors;
      EXPECT_THAT(cs_recording_error_text(opened.get()), HasSubstr("the chunk at byte"));
      continue;
    }
    ++frames;
    EXPECT_EQ(cs_reconstruction_hash(opened.client()), message.reconstruction_hash);
  }
  EXPECT_EQ(errors, 1u);
  // Frames after the chunk wait for the next key frame.
  EXPECT_LT(frames, kSampleFrames - 12u);
  EXPECT_GT(frames, kSampleFrames - 12u - kMaxKeyFrameDistance);
  EXPECT_EQ(message.tick, std::uint64_t{kSampleFrames});
}

cs_recording_faults faultsOf(const Opened& opened) {
  cs_recording_faults faults{};
  faults.version = CS_RECORDING_FAULTS_VERSION + 1;
  EXPECT_EQ(cs_recording_get_faults(opened.get(), &faults), 0) << "the version is unknown";
  faults.version = CS_RECORDING_FAULTS_VERSION;
  EXPECT_EQ(cs_recording_get_faults(opened.get(), &faults), 1);
  return faults;
}

// Reads to the end. Returns the ticks of the frames, and the texts of the errors.
struct Read {
  std::vector<std::uint64_t> ticks;
  std::vector<std::string> errors;
};
Read readFrames(const Opened& opened) {
  Read read;
  cs_recorded message = emptyMessage();
  for (;;) {
    const cs_recording_result result = cs_recording_next(opened.get(), CS_RECORDED_FRAME, &message);
    if (result == CS_RECORDING_END) return read;
    if (result == CS_RECORDING_NEXT)
      read.ticks.push_back(message.tick);
    else
      read.errors.emplace_back(cs_recording_error_text(opened.get()));
  }
}

TEST(ClientRecording, ReportsFramesThatCannotBeDecodedOnceAndCountsAll) {
  const Opened opened(withGarbage(sampleRecording(kSampleFrames)));
  const Read read = readFrames(opened);
  EXPECT_TRUE(read.ticks.empty());
  ASSERT_EQ(read.errors.size(), 1u);
  EXPECT_EQ(read.errors[0], "the frame of an unknown tick at 0.000 s cannot be decoded");
  const cs_recording_faults faults = faultsOf(opened);
  EXPECT_EQ(faults.frames, kSampleFrames);
  EXPECT_EQ(faults.undecodable, kSampleFrames);
  EXPECT_EQ(faults.different, 0u);
  EXPECT_EQ(faults.first_tick, 0u);
}

TEST(ClientRecording, ContinuesAtTheKeyFrameAfterAFrameThatCannotBeDecoded) {
  const Opened opened(withFrames(sampleRecording(kSampleFrames), [](std::size_t frame, v1::Frame& changed) {
    if (frame == 30 || frame == 100) changed.mutable_packet()->back() ^= 1;
  }));
  const Read read = readFrames(opened);
  ASSERT_EQ(read.errors.size(), 2u) << "one error for each gap";
  EXPECT_THAT(read.errors[0], HasSubstr("the frame of tick 31 at 0.500 s"));
  EXPECT_THAT(read.errors[1], HasSubstr("the frame of tick 101 at"));
  // Frames 30 to 47 and 100 to 119 depend on the changed ones.
  EXPECT_EQ(read.ticks.size(), kSampleFrames - 18u - 20u);
  const cs_recording_faults faults = faultsOf(opened);
  EXPECT_EQ(faults.frames, kSampleFrames);
  EXPECT_EQ(faults.undecodable + faults.different, 38u);
  EXPECT_EQ(faults.first_tick, 31u);
  EXPECT_NEAR(faults.first_seconds, 0.5, 1e-6);

  cs_recorded found = emptyMessage();
  EXPECT_EQ(cs_recording_seek_tick(opened.get(), 40, &found), 0) << "frame 30 is in between";
  EXPECT_THAT(cs_recording_error_text(opened.get()), HasSubstr("tick 31"));
  ASSERT_EQ(cs_recording_seek_tick(opened.get(), 60, &found), 1);
  EXPECT_EQ(found.tick, 60u);
}

TEST(ClientRecording, ReportsAFrameThatDiffersFromItsHash) {
  const Opened opened(withFrames(sampleRecording(kSampleFrames), [](std::size_t frame, v1::Frame& changed) {
    if (frame == 30) changed.set_reconstruction_hash(changed.reconstruction_hash() ^ 1);
  }));
  const Read read = readFrames(opened);
  ASSERT_EQ(read.errors.size(), 1u);
  EXPECT_EQ(read.errors[0], "the frame of tick 31 at 0.500 s differs from its recorded hash");
  EXPECT_EQ(read.ticks.size(), kSampleFrames - 18u) << "frames 31 to 47 depend on it";
  const cs_recording_faults faults = faultsOf(opened);
  EXPECT_EQ(faults.frames, kSampleFrames);
  EXPECT_EQ(faults.different, 1u);
  EXPECT_EQ(faults.undecodable, 17u);
}

// A wrong tick in a key frame makes all later frames look old.
TEST(ClientRecording, CountsFramesAfterATickThatIsTooLarge) {
  const Opened opened(withFrames(sampleRecording(kSampleFrames), [](std::size_t frame, v1::Frame& changed) {
    if (frame != 48) return;
    const std::string packet = changed.packet();
    auto parsed = codec::parsePacket(std::as_bytes(std::span(packet)));
    parsed->header.tick = std::uint64_t{1} << 40;
    std::vector<std::byte> made(codec::headerBound(parsed->header));
    made.resize(codec::writeHeader(parsed->header, made));
    made.insert(made.end(), parsed->body.begin(), parsed->body.end());
    changed.set_packet(made.data(), made.size());
  }));
  const Read read = readFrames(opened);
  EXPECT_EQ(read.errors.size(), 1u);
  EXPECT_EQ(read.ticks.size(), 49u);
  EXPECT_EQ(faultsOf(opened).undecodable, kSampleFrames - 49u);
}

TEST(ClientRecording, AcceptsARepeatedFrame) {
  std::string last;
  const Opened opened(withFrames(sampleRecording(kSampleFrames), [&](std::size_t frame, v1::Frame& changed) {
    if (frame % kMaxKeyFrameDistance == 23) changed.ParseFromString(last);
    changed.SerializeToString(&last);
  }));
  const Read read = readFrames(opened);
  EXPECT_TRUE(read.errors.empty());
  EXPECT_EQ(faultsOf(opened).frames, kSampleFrames);
}

TEST(ClientRecording, RefusesMoreVerticesThanAllowed) {
  const auto bytesOf = [](std::uint32_t vertices) {
    return withMessages(sampleRecording(3), Topic::description, [&](std::size_t, std::string& bytes) {
      v1::StreamDescription description = sampleDescription();
      v1::ClothDescription& cloth = *description.mutable_cloths(0);
      cloth.set_vertex_count(vertices);
      cloth.set_rows(1);
      cloth.set_columns(vertices);
      bytes = description.SerializeAsString();
    });
  };
  const auto errorOf = [&](std::uint32_t vertices, std::uint32_t most) {
    const std::string bytes = bytesOf(vertices);
    const Handle opened(
        cs_recording_open_bytes(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), most),
        &cs_recording_close);
    EXPECT_EQ(cs_recording_is_open(opened.get()), 0);
    return std::string(cs_recording_error_text(opened.get()));
  };
  EXPECT_THAT(errorOf(1'048'577, 0), HasSubstr("1048577 vertices; this client accepts at most 1048576"));
  EXPECT_THAT(errorOf(1'048'577, 1'048'577), HasSubstr("rest_positions"));
  EXPECT_THAT(errorOf(50, 49), HasSubstr("50 vertices; this client accepts at most 49"));
  EXPECT_THAT(errorOf(42, 67'108'865), HasSubstr("use 1 to 67108864"));
}

TEST(ClientRecording, ReadsAnyBytesSafely) {
  const std::string whole = sampleWithSliders(40);
  std::mt19937 random(1);
  for (int round = 0; round < 1000; ++round) {
    std::string bytes = whole;
    for (unsigned i = 0, changes = 1 + random() % 4; i < changes; ++i) {
      const std::size_t at = random() % bytes.size();
      switch (random() % 3) {
        case 0:
          bytes[at] = static_cast<char>(random());
          break;
        case 1:  // a length or an offset that is huge
          bytes.replace(at, std::min<std::size_t>(8, bytes.size() - at), 8, static_cast<char>(0xff));
          break;
        default:
          bytes.erase(at, random() % 64);
      }
    }
    const Opened opened(bytes);
    bool failed = false;
    readAll(opened, &failed);
    (void)cs_recording_seek(opened.get(), 0.001 * static_cast<double>(random() % 1000), nullptr);
    readAll(opened, &failed);
    (void)cs_recording_seek_tick(opened.get(), random() % 50, nullptr);
    readAll(opened, &failed);
  }
}

TEST(ClientRecording, EndsAtAMalformedMessage) {
  std::string bytes;
  auto writer = RecordingWriter::begin(
      [&](std::string_view more) {
        bytes += more;
        return Written();
      },
      "test", {{"scene", "sample"}});
  ASSERT_TRUE(writer->write(Topic::description, 1, sampleDescription().SerializeAsString()));
  ASSERT_TRUE(writer->write(Topic::ticks, 1, std::string("\xff\xff", 2)));
  ASSERT_TRUE(writer->write(Topic::frames, 2, std::string("\xff\xff", 2)));
  ASSERT_TRUE(writer->finish());
  const Opened opened(bytes);
  cs_recorded message = emptyMessage();
  EXPECT_EQ(cs_recording_next(opened.get(), CS_RECORDED_ALL, &message), CS_RECORDING_ERROR);
  EXPECT_THAT(cs_recording_error_text(opened.get()), HasSubstr("malformed RecordedTick"));
  for (int again = 0; again < 3; ++again) {
    EXPECT_EQ(cs_recording_next(opened.get(), CS_RECORDED_ALL, &message), CS_RECORDING_ERROR);
    EXPECT_THAT(cs_recording_error_text(opened.get()), HasSubstr("Frame"));
  }
  EXPECT_EQ(cs_recording_seek(opened.get(), 0, nullptr), 0);
}

TEST(ClientRecording, SaysWhyItCannotBeOpened) {
  const Handle missing(cs_recording_open("no such file.mcap", 0), &cs_recording_close);
  EXPECT_EQ(cs_recording_is_open(missing.get()), 0);
  EXPECT_THAT(cs_recording_error_text(missing.get()), HasSubstr("cannot read no such file.mcap"));
  const Handle folder(cs_recording_open("tests", 0), &cs_recording_close);
  EXPECT_THAT(cs_recording_error_text(folder.get()), HasSubstr("not a regular file"));
  const Opened other("PNG");
  EXPECT_THAT(cs_recording_error_text(other.get()), HasSubstr("not an MCAP file"));
  cs_recorded message = emptyMessage();
  EXPECT_EQ(cs_recording_next(other.get(), CS_RECORDED_ALL, &message), CS_RECORDING_ERROR);
  EXPECT_EQ(cs_recording_seek(other.get(), 0, &message), 0);
  EXPECT_STREQ(cs_recording_metadata(other.get(), "scene"), "");
  cs_recording_close(nullptr);
}

TEST(ClientRecording, ReadsThroughAFunction) {
  struct Source {
    std::string bytes = sampleRecording(kSampleFrames);
    std::uint64_t read = 0;
    bool fails = false;
  } source;
  const auto read = [](void* user, uint64_t offset, uint8_t* bytes, size_t count) {
    auto& from = *static_cast<Source*>(user);
    EXPECT_LE(offset + count, from.bytes.size());
    std::memcpy(bytes, from.bytes.data() + offset, count);
    from.read += count;
    return from.fails ? 0 : 1;
  };
  cs_recording_source given{CS_RECORDING_SOURCE_VERSION, 0, source.bytes.size(), &source, read};
  const Handle opened(cs_recording_open_source(&given), &cs_recording_close);
  ASSERT_EQ(cs_recording_is_open(opened.get()), 1) << cs_recording_error_text(opened.get());
  cs_recorded message = emptyMessage();
  ASSERT_EQ(cs_recording_seek(opened.get(), 2, &message), 1);
  EXPECT_LT(source.read, source.bytes.size()) << "a seek reads the chunks that it needs";
  source.fails = true;
  EXPECT_EQ(cs_recording_seek(opened.get(), 0.5, &message), 0);
  EXPECT_THAT(cs_recording_error_text(opened.get()), HasSubstr("cannot be read"));
  source.fails = false;
  EXPECT_EQ(cs_recording_seek(opened.get(), 0.5, &message), 1);
  given.version = 99;
  const Handle unknown(cs_recording_open_source(&given), &cs_recording_close);
  EXPECT_THAT(cs_recording_error_text(unknown.get()), HasSubstr("unknown version"));
}

}  // namespace
}  // namespace clothstream::recording
