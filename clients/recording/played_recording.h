// SPDX-License-Identifier: MIT
// Plays a recording in a client, message by message, from any time on.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "clients/core/core.h"
#include "clients/core/wire/server_message.h"
#include "clients/recording/journal.h"
#include "proto/recording/frame_faults.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::client {

// A message that the client has got, or one of the journal.
struct PlayedMessage {
  std::uint32_t kind = 0;    // CS_RECORDED value
  std::uint32_t events = 0;  // CS_EVENT bits of the client
  std::uint64_t time = 0;    // ns since 1970
  std::uint64_t tick = 0;
  bool key = false;
  std::uint64_t reconstructionHash = 0, stateHash = 0;
  std::string_view bytes;  // serialised; valid until the next call of the recording
};

// Safe on any bytes. Errors describe the problem.
class PlayedRecording {
 public:
  // The client accepts as many vertices as the reader.
  [[nodiscard]] static tl::expected<PlayedRecording, std::string> open(recording::RecordingReader reader);

  // Continues to the next message of these kinds; nothing at the end. A damaged chunk is an error, and so is
  // a frame that cannot be decoded or differs from its recorded hash: the next call continues behind it. Of
  // consecutive frames with such a fault only the first one is an error, because the others depend on it.
  // faults() counts all of them.
  [[nodiscard]] tl::expected<std::optional<PlayedMessage>, std::string> next(std::uint32_t kinds);
  // Continues to the next frame. Returns false at the end.
  [[nodiscard]] tl::expected<bool, std::string> next();
  // Goes to the newest frame at or before a time (ns since 1970) or a tick; nothing without such a frame. A
  // frame with a fault between this frame and its key frame is an error.
  [[nodiscard]] tl::expected<std::optional<PlayedMessage>, std::string> seek(std::uint64_t time);
  [[nodiscard]] tl::expected<std::optional<PlayedMessage>, std::string> seekTick(std::uint64_t tick);

  const cs_client* client() const { return client_.get(); }
  const recording::RecordingReader& reader() const { return reader_; }
  // Time of the newest frame since the start of the recording, s.
  double seconds() const { return secondsOf(frameTime_); }
  // Hash of the exact state of the newest frame; 0 if it is not known.
  std::uint64_t stateHash() const { return newestFrame_ ? newestFrame_->stateHash : 0; }
  // All frames so far; frames that are read again after a seek count again.
  const recording::FrameFaults& faults() const { return faults_; }
  // Reads to the end, so that faults() counts every frame. Returns false if a malformed message prevents it.
  bool readToTheEnd();
  double secondsOf(std::uint64_t time) const { return static_cast<double>(time - reader_.start()) * 1e-9; }
  // The newest tick and checkpoint; nothing before the first and after a seek.
  const std::optional<RecordedTick>& tick() const { return tick_; }
  const std::optional<Checkpoint>& checkpoint() const { return checkpoint_; }

 private:
  using Place = recording::RecordingReader::Place;
  using Played = tl::expected<std::optional<PlayedMessage>, std::string>;
  explicit PlayedRecording(recording::RecordingReader reader);

  [[nodiscard]] tl::expected<void, std::string> describe();
  [[nodiscard]] Played apply(const recording::RecordedMessage& message);
  [[nodiscard]] Played applyFrame(const recording::RecordedMessage& message, PlayedMessage played);
  [[nodiscard]] Played fault(std::string what);
  [[nodiscard]] bool applyJournal(const recording::RecordedMessage& message, PlayedMessage& played);
  [[nodiscard]] bool applyParticipant(std::string_view message, PlayedMessage& played);
  std::uint32_t give(field::Field body, std::string_view message, std::uint64_t time);
  std::uint32_t givePresence(std::uint32_t kind, const cs_participant& participant, std::uint64_t time);
  void applyHistory(const Place& from, const Place& to);
  [[nodiscard]] Played seekTo(std::uint64_t time, std::optional<std::uint64_t> tick);
  std::optional<std::uint64_t> firstTickIn(std::size_t chunk);

  recording::RecordingReader reader_;
  std::unique_ptr<cs_client, decltype(&cs_destroy)> client_;
  std::string envelope_;  // serialised ServerMessage; reused
  Frame frame_;           // reused
  std::optional<PlayedMessage> newestFrame_;
  recording::FrameFaults faults_;
  bool isLost_ = false;                     // a fault was reported, and no frame was good since then
  std::uint64_t frameTime_ = 0, time_ = 0;  // of the newest frame and the newest message, ns since 1970
  std::optional<RecordedTick> tick_;
  std::optional<Checkpoint> checkpoint_;
};

}  // namespace clothstream::client
