// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/recording_target.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include <clothstream/recording.h>

#include "clothstream/v1/recording.pb.h"
#include "inputs.pb.h"
#include "proto/recording/recorded_description.h"
#include "proto/recording/recording_reader.h"
#include "proto/recording/recording_writer.h"
#include "server/messages/scene_message.h"
#include "server/recording/recorded_stream.h"
#include "server/recording/tick_message.h"
#include "server/scene/snapshot_message.h"
#include "server/simulation/cloth_simulation.h"
#include "tests/codec/golden.h"

namespace clothstream::fuzz {
namespace {

using recording::CutFiles;
using recording::RecordingReader;
using recording::Topic;

constexpr std::uint64_t kMaxNodes = 16'384;
// Nodes that a state is compared with if the recording has no scene.
constexpr std::uint32_t kNodesWithoutScene = 4;
constexpr std::uint64_t kMillisecond = 1'000'000;  // ns

const codec::GoldenStream& golden() {
  static const std::vector<codec::GoldenStream> streams = codec::readGoldenStreams();
  return streams.front();
}

std::string contentOf(const RecordingInput::Entry& entry) {
  using Entry = RecordingInput::Entry;
  switch (entry.content_case()) {
    case Entry::kScene:
      return entry.scene().SerializeAsString();
    case Entry::kTick:
      return entry.tick().SerializeAsString();
    case Entry::kCheckpoint:
      return entry.checkpoint().SerializeAsString();
    case Entry::kGolden: {
      const codec::GoldenPacket& packet = golden().packets[entry.golden() % golden().packets.size()];
      v1::Frame frame;
      frame.set_packet(packet.bytes.data(), packet.bytes.size());
      frame.set_reconstruction_hash(packet.reconstructionHash);
      return frame.SerializeAsString();
    }
    default:
      return entry.raw();
  }
}

std::string fileOf(const RecordingInput& input) {
  if (!input.file().empty()) return input.file();
  std::string bytes;
  auto writer = recording::RecordingWriter::begin(
      [&](std::string_view more) {
        bytes += more;
        return recording::Written();
      },
      "fuzz", {{"scene", "sample"}, {"device", "none"}});
  std::uint64_t time = 1;
  for (const RecordingInput::Entry& entry : input.entries()) {
    // Times of a writer never go back.
    time += entry.milliseconds() % 1'000'000 * kMillisecond;
    const auto written =
        entry.has_message() ? writer->write(time, entry.message())
                            : writer->write(static_cast<Topic>(entry.topic() % recording::kTopicNames.size()),
                                            time, contentOf(entry));
    require(written.has_value(), "memory has room");
  }
  require(writer->finish().has_value(), "memory has room");
  for (const Patch& patch : input.patches()) {
    if (bytes.empty()) break;
    const std::size_t at = patch.offset() % bytes.size();
    if (patch.cut() > 0)
      bytes.erase(at, patch.cut());
    else
      std::memcpy(bytes.data() + at, patch.bytes().data(), std::min(patch.bytes().size(), bytes.size() - at));
  }
  bytes.resize(bytes.size() - std::min<std::size_t>(input.cut(), bytes.size()));
  return bytes;
}

tl::expected<RecordingReader, std::string> open(const std::string& bytes, CutFiles cutFiles) {
  return RecordingReader::open(std::make_unique<recording::MemorySource>(bytes), "input", cutFiles);
}

template <typename Message>
Message parsed(std::string_view bytes) {
  Message message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) message.Clear();
  return message;
}

// Converts recorded scenes and ticks as recording::resimulate() does before the device gets them.
class Simulation {
 public:
  void take(const v1::RecordedScene& message) {
    auto scene = messages::toScene(message.scene(), {}, {.nodes = kMaxNodes});
    if (!scene) return;
    definition_ = message.scene();
    scene_ = std::move(*scene);
  }
  void take(const v1::Checkpoint& message) {
    const auto nodes = scene_ ? static_cast<std::uint32_t>(scene_->nodeCount()) : kNodesWithoutScene;
    const auto snapshot = scene::toSnapshot(message, nodes);
    if (!snapshot) return require(!snapshot.error().empty(), "an error has a text");
    require(snapshot->bytes.size() == nodes * simulation::kSnapshotBytesPerNode,
            "an accepted state has every node of its scene");
    for (const simulation::HeldNode& held : snapshot->held.nodes)
      require(held.node < nodes && held.grab < snapshot->held.grabs.size(),
              "held nodes and their grabs exist");
    static_cast<void>(simulation::statusOf(*snapshot));
    v1::Checkpoint written;
    scene::write(*snapshot, written);
    require(scene::toSnapshot(written, nodes).has_value(), "an accepted state is accepted again");
  }
  void take(const v1::RecordedTick& message) {
    if (!scene_) return;
    if (message.cloths_size() > 0)
      if (const auto cloths = recording::toCloths(message, definition_))
        require(cloths->size() == scene_->cloths.size(), "a tick has the cloths of its scene");
    if (const auto inputs = recording::toInputs(message, *scene_)) {
      require(inputs->colliders.size() <= simulation::kMaxColliders,
              "the simulation has room for all colliders");
      require(inputs->grabs.size() <= simulation::kMaxGrabs, "the simulation has room for all grabs");
    }
  }

 private:
  v1::Scene definition_;
  std::optional<model::Scene> scene_;
};

// Messages of the file in order, with what simulating again needs of them.
void readAll(const std::string& bytes) {
  auto reader = open(bytes, CutFiles::read);
  if (!reader) return require(!reader.error().empty(), "an error has a text");
  static_cast<void>(reader->check());
  static_cast<void>(recording::readDescription(*reader));
  Simulation simulation;
  for (;;) {
    const auto message = reader->next();
    if (!message) {
      static_cast<void>(reader->passChunk());
      continue;
    }
    if (!*message) return;
    const std::string_view content = (*message)->bytes;
    if ((*message)->topic == Topic::scene)
      simulation.take(parsed<v1::RecordedScene>(content));
    else if ((*message)->topic == Topic::ticks)
      simulation.take(parsed<v1::RecordedTick>(content));
    else if ((*message)->topic == Topic::checkpoints)
      simulation.take(parsed<v1::Checkpoint>(content));
  }
}

// As `clothstream recover`: every readable chunk in a new file, which is complete.
void recover(const std::string& bytes) {
  auto damaged = open(bytes, CutFiles::read);
  auto mcap = recording::McapReader::open(std::make_unique<recording::MemorySource>(bytes));
  require(damaged.has_value() <= mcap.has_value(), "a recording is a file that can be read");
  if (!damaged) return;
  std::string copy;
  auto writer = recording::RecordingWriter::begin(
      [&](std::string_view more) {
        copy += more;
        return recording::Written();
      },
      "fuzz", damaged->metadata());
  std::uint64_t messages = 0;
  for (std::size_t i = 0; i < mcap->chunks().size(); ++i) {
    const auto chunk = mcap->read(i);
    if (!chunk) continue;
    for (const recording::Message& message : *chunk) {
      const auto topic = damaged->topicOf(message.channel);
      if (!topic) continue;
      require(writer->write(*topic, message.time, message.bytes).has_value(), "memory has room");
      ++messages;
    }
  }
  require(writer->finish().has_value(), "memory has room");
  auto again = open(copy, CutFiles::refused);
  require(again.has_value() && again->check().has_value(), "a recovered recording is complete");
  std::uint64_t read = 0;
  for (auto message = again->next(); message && *message; message = again->next()) ++read;
  require(read == messages, "a recovered recording has every readable message");
}

void play(const std::string& bytes, const RecordingInput& input) {
  auto reader = open(bytes, CutFiles::read);
  if (!reader) return;
  auto stream = recording::RecordedStream::of(std::move(*reader));
  if (!stream) return require(!stream.error().empty(), "an error has a text");
  const auto readToTheEnd = [&] {
    // Every message, loss and end comes once.
    for (std::size_t i = 0; i <= bytes.size(); ++i)
      if (std::holds_alternative<recording::RecordedStream::End>(stream->next())) return;
    require(false, "a recording ends");
  };
  readToTheEnd();
  int seeks = 0;
  for (const float seconds : input.seeks()) {
    if (++seeks > 8) return;
    const double position = std::clamp(std::isfinite(seconds) ? double{seconds} : 0, 0.0, stream->length());
    stream->seek(position);
    static_cast<void>(stream->parametersAt(position));
    readToTheEnd();
  }
}

// Reads to the end through the C interface, as a client without a server does.
void readToTheEnd(cs_recording* recording, std::size_t most) {
  cs_recorded message{};
  // Every message and every chunk that cannot be read come once.
  for (std::size_t i = 0; i <= most; ++i) {
    const cs_recording_result result = cs_recording_next(recording, CS_RECORDED_ALL, &message);
    if (result == CS_RECORDING_END) return;
    if (result == CS_RECORDING_ERROR) {
      require(*cs_recording_error_text(recording) != '\0', "an error has a text");
      if (cs_get_state(cs_recording_client(recording)) == CS_STATE_FAILED) return;
      continue;
    }
    cs_recorded_tick tick{};
    cs_recorded_collider collider{};
    if (cs_recording_get_tick(recording, &tick) == 1)
      require(cs_recording_get_collider(recording, tick.collider_count, &collider) == 0,
              "a tick has as many colliders as it says");
    std::uint32_t nodes = 0;
    const float* state = cs_recording_state(recording, &nodes, nullptr);
    float sum = 0;  // read, so that a sanitizer finds a state that is too small
    for (std::size_t number = 0; number < std::size_t{6} * nodes; ++number) sum += state[number];
    require(nodes > 0 || sum == 0, "no nodes have no state");
    const cs_client* client = cs_recording_client(recording);
    const float* positions = cs_positions(client);
    for (std::size_t number = 0; number < std::size_t{3} * cs_vertex_count(client); ++number)
      require(std::isfinite(positions[number]), "positions are numbers");
  }
  require(false, "a recording ends");
}

void playInClient(const std::string& bytes, const RecordingInput& input) {
  cs_recording* recording =
      cs_recording_open_bytes(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), 0);
  require((cs_recording_is_open(recording) == 1) == (cs_recording_client(recording) != nullptr),
          "an open recording has a client");
  if (cs_recording_is_open(recording) == 1) {
    readToTheEnd(recording, bytes.size());
    int seeks = 0;
    for (const float seconds : input.seeks()) {
      if (++seeks > 8) break;
      if (cs_recording_seek(recording, seconds, nullptr) == 1) readToTheEnd(recording, bytes.size());
      const std::uint64_t tick =
          std::isfinite(seconds) ? static_cast<std::uint64_t>(std::fmod(std::abs(seconds), 64)) : 0;
      if (cs_recording_seek_tick(recording, tick, nullptr) == 1) readToTheEnd(recording, bytes.size());
    }
  }
  cs_recording_close(recording);
}

void run(const RecordingInput& input) {
  const std::string bytes = fileOf(input);
  readAll(bytes);
  recover(bytes);
  play(bytes, input);
  playInClient(bytes, input);
}

constexpr std::array<std::string_view, 3> kWords{"sheet", "sample", "ball"};

}  // namespace

const Target kRecordingTarget{.name = "recording",
                              .run = &runStructured<RecordingInput, &run>,
                              .structure = &RecordingInput::default_instance(),
                              .words = kWords};

}  // namespace clothstream::fuzz
