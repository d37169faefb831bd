// SPDX-License-Identifier: MIT
// C interface: opening, reading, seeking, and the journal.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include <clothstream/recording.h>

#include "clients/recording/recording_handle.h"

using namespace clothstream;
using namespace clothstream::client;

namespace clothstream::client {
namespace {

// Bytes that the caller keeps.
class BorrowedBytes : public recording::ByteSource {
 public:
  explicit BorrowedBytes(std::string_view bytes) : bytes_(bytes) {}
  std::uint64_t size() const override { return bytes_.size(); }
  bool read(std::uint64_t offset, std::uint64_t count, std::string& out) const override {
    out.assign(bytes_.substr(static_cast<std::size_t>(offset), static_cast<std::size_t>(count)));
    return true;
  }

 private:
  std::string_view bytes_;
};

std::uint64_t countOf(const recording::RecordingReader& reader, recording::Topic topic) {
  const auto& statistics = reader.mcap().statistics();
  if (!statistics) return 0;
  std::uint64_t count = 0;
  for (const auto& [channel, messages] : statistics->counts)
    if (reader.topicOf(channel) == topic) count += messages;
  return count;
}

void write(const PlayedRecording& played, const PlayedMessage& message, cs_recorded& out) {
  out = {.version = CS_RECORDED_VERSION,
         .kind = message.kind,
         .events = message.events,
         .key = message.key ? 1 : 0,
         .seconds = played.secondsOf(message.time),
         .tick = message.tick,
         .reconstruction_hash = message.reconstructionHash,
         .state_hash = message.stateHash};
}

// Writes the result of a seek. `seek` is a member of PlayedRecording with `where`.
template <typename Seek, typename Where>
int seekWith(cs_recording* recording, Seek seek, Where where, cs_recorded* out) {
  if (!recording->played || (out && out->version != CS_RECORDED_VERSION)) return 0;
  recording->message = {};
  const auto frame = ((*recording->played).*seek)(where);
  if (!frame) {
    recording->errorText = frame.error();
    return 0;
  }
  if (!out) return 1;
  *out = {};
  if (*frame) write(*recording->played, **frame, *out);
  return 1;
}

// Copies an element of a list of the newest tick.
template <typename List, typename Out>
int writeElement(const cs_recording* recording, List RecordedTick::*list, std::uint32_t index, Out* out) {
  if (!recording->played || !recording->played->tick()) return 0;
  const List& elements = *recording->played->tick().*list;
  if (index >= elements.size()) return 0;
  *out = elements[index];
  return 1;
}

}  // namespace

cs_recording* openRecording(tl::expected<std::unique_ptr<recording::ByteSource>, std::string> source,
                            std::string name, std::uint32_t maxVertices) {
  auto* opened =
      new cs_recording;  // NOLINT(bugprone-unhandled-exception-at-new): out of memory ends the program
  const auto open = [&]() -> tl::expected<PlayedRecording, std::string> {
    if (!source) return tl::unexpected(source.error());
    recording::ReadLimits limits;
    if (maxVertices > 0) limits.vertices = maxVertices;
    auto reader = recording::RecordingReader::open(std::move(*source), std::move(name),
                                                   recording::CutFiles::read, limits);
    if (!reader) return tl::unexpected(reader.error());
    return PlayedRecording::open(std::move(*reader));
  };
  auto played = open();
  if (played)
    opened->played.emplace(std::move(*played));
  else
    opened->errorText = played.error();
  return opened;
}

}  // namespace clothstream::client

cs_recording* cs_recording_open_bytes(const uint8_t* bytes, size_t count, uint32_t max_vertices) noexcept {
  return openRecording(
      std::make_unique<BorrowedBytes>(std::string_view(reinterpret_cast<const char*>(bytes), count)),
      "the recording", max_vertices);
}

void cs_recording_close(cs_recording* recording) noexcept {
  delete recording;
}

int cs_recording_is_open(const cs_recording* recording) noexcept {
  return recording->played ? 1 : 0;
}

const char* cs_recording_error_text(const cs_recording* recording) noexcept {
  return recording->errorText.c_str();
}

const cs_client* cs_recording_client(const cs_recording* recording) noexcept {
  return recording->played ? recording->played->client() : nullptr;
}

int cs_recording_get_info(const cs_recording* recording, cs_recording_info* out) noexcept {
  if (!recording->played || out->version != CS_RECORDING_INFO_VERSION) return 0;
  const recording::RecordingReader& reader = recording->played->reader();
  *out = {.version = CS_RECORDING_INFO_VERSION,
          .complete = reader.mcap().indexed() ? 1 : 0,
          .seconds = recording->played->secondsOf(std::max(reader.start(), reader.end())),
          .start_ns = reader.start(),
          .bytes = reader.mcap().bytes(),
          .frames = countOf(reader, recording::Topic::frames),
          .ticks = countOf(reader, recording::Topic::ticks)};
  return 1;
}

const char* cs_recording_metadata(const cs_recording* recording, const char* name) noexcept {
  if (!recording->played) return "";
  const recording::Metadata& metadata = recording->played->reader().metadata();
  const auto found = metadata.find(name);
  return found == metadata.end() ? "" : found->second.c_str();
}

cs_recording_result cs_recording_next(cs_recording* recording, uint32_t kinds, cs_recorded* out) noexcept {
  if (!recording->played) return CS_RECORDING_ERROR;
  if (out->version != CS_RECORDED_VERSION) {
    recording->errorText = "cs_recorded has an unknown version; set it to CS_RECORDED_VERSION.";
    return CS_RECORDING_ERROR;
  }
  const auto message = recording->played->next(kinds);
  recording->message = {};
  if (!message) {
    recording->errorText = message.error();
    return CS_RECORDING_ERROR;
  }
  if (!*message) return CS_RECORDING_END;
  recording->message = (*message)->bytes;
  write(*recording->played, **message, *out);
  return CS_RECORDING_NEXT;
}

int cs_recording_seek(cs_recording* recording, double seconds, cs_recorded* out) noexcept {
  if (!recording->played) return 0;
  if (std::isnan(seconds)) {
    recording->errorText =
        "The time of a seek is not a number; use seconds since the start of the recording.";
    return 0;
  }
  const recording::RecordingReader& reader = recording->played->reader();
  const std::uint64_t length = std::max(reader.start(), reader.end()) - reader.start();
  const double ns = seconds * 1e9;
  const std::uint64_t since = ns <= 0 ? 0
                              : ns >= static_cast<double>(length)
                                  ? length
                                  : static_cast<std::uint64_t>(std::llround(ns));
  return seekWith(recording, &PlayedRecording::seek, reader.start() + since, out);
}

int cs_recording_seek_tick(cs_recording* recording, uint64_t tick, cs_recorded* out) noexcept {
  return seekWith(recording, &PlayedRecording::seekTick, tick, out);
}

int cs_recording_get_faults(const cs_recording* recording, cs_recording_faults* out) noexcept {
  if (!recording->played || out->version != CS_RECORDING_FAULTS_VERSION) return 0;
  const recording::FrameFaults& faults = recording->played->faults();
  *out = {.version = CS_RECORDING_FAULTS_VERSION,
          .frames = faults.frames(),
          .undecodable = faults.undecodable(),
          .different = faults.different(),
          .first_tick = faults.firstTick().value_or(0),
          .first_seconds = faults.firstSeconds()};
  return 1;
}

const uint8_t* cs_recording_message(const cs_recording* recording, size_t* bytes) noexcept {
  *bytes = recording->message.size();
  return recording->message.empty() ? nullptr
                                    : reinterpret_cast<const std::uint8_t*>(recording->message.data());
}

int cs_recording_get_tick(const cs_recording* recording, cs_recorded_tick* out) noexcept {
  if (!recording->played || !recording->played->tick() || out->version != CS_RECORDED_TICK_VERSION) return 0;
  const RecordedTick& tick = *recording->played->tick();
  *out = {.version = CS_RECORDED_TICK_VERSION,
          .recovery = tick.recovery,
          .tick = tick.tick,
          .state_hash = tick.stateHash,
          .unhealthy = tick.unhealthy ? 1 : 0,
          .saves_state = tick.savesState ? 1 : 0,
          .gravity = {tick.gravity[0], tick.gravity[1], tick.gravity[2]},
          .wind = {tick.wind[0], tick.wind[1], tick.wind[2]},
          .air_density = tick.airDensity,
          .substeps = tick.substeps,
          .collider_count = static_cast<std::uint32_t>(tick.colliders.size()),
          .attachment_count = static_cast<std::uint32_t>(tick.attachments.size()),
          .grab_count = static_cast<std::uint32_t>(tick.grabs.size())};
  return 1;
}

int cs_recording_get_collider(const cs_recording* recording, uint32_t index,
                              cs_recorded_collider* out) noexcept {
  if (out->version != CS_RECORDED_COLLIDER_VERSION) return 0;
  return writeElement(recording, &RecordedTick::colliders, index, out);
}

int cs_recording_get_attachment(const cs_recording* recording, uint32_t index,
                                cs_recorded_pose* out) noexcept {
  return writeElement(recording, &RecordedTick::attachments, index, out);
}

int cs_recording_get_grab(const cs_recording* recording, uint32_t index, cs_recorded_grab* out) noexcept {
  if (out->version != CS_RECORDED_GRAB_VERSION) return 0;
  return writeElement(recording, &RecordedTick::grabs, index, out);
}

const float* cs_recording_state(const cs_recording* recording, uint32_t* node_count,
                                uint64_t* tick) noexcept {
  *node_count = 0;
  if (!recording->played || !recording->played->checkpoint()) return nullptr;
  const Checkpoint& checkpoint = *recording->played->checkpoint();
  *node_count = static_cast<std::uint32_t>(checkpoint.state.size() / 6);
  if (tick) *tick = checkpoint.tick;
  return checkpoint.state.data();
}
