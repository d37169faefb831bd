// SPDX-License-Identifier: MIT
// Messages of a recording in playback order.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"
#include "proto/recording/frame_check.h"
#include "proto/recording/recording_reader.h"
#include "server/recording/parameter_history.h"
#include "server/recording/parameters_in_force.h"

namespace clothstream::recording {

// Maximum distance between consecutive ticks of a stream.
inline constexpr std::uint64_t kMaxTickStep = std::uint64_t{1} << 32;

// Yields frames that can be decoded in order, starting with a key frame, and the announcements between them.
// Decodes each of them; leaves out and reports everything that cannot be read, cannot be decoded or differs
// from its recorded hash. Safe for any bytes.
class RecordedStream {
 public:
  // The error names the path and the problem. A truncated file is read up to its end. Reads every chunk with
  // a change of parameters, so that a seek does not have to. A file with frames of which none can be decoded
  // is an error.
  [[nodiscard]] static tl::expected<RecordedStream, std::string> open(const std::string& path,
                                                                      const ReadLimits& limits = {});
  [[nodiscard]] static tl::expected<RecordedStream, std::string> of(RecordingReader reader);

  // Description of the stream at the start of the recording.
  const v1::StreamDescription& description() const { return description_; }
  // Name of the recorded scene, out of [a-z0-9_-]; "recording" if the name is invalid.
  const std::string& scene() const { return scene_; }
  const std::string& device() const { return reader_.metadata("device"); }
  // True if the end of the file is missing.
  bool truncated() const { return !reader_.mcap().indexed(); }
  // Reads every byte, checks all checksums and decodes every frame. The error names the path and the problem.
  // Call it before the first next().
  [[nodiscard]] tl::expected<void, std::string> check();
  // Frames so far; frames that are read again count again.
  const FrameFaults& faults() const { return check_.faults(); }
  // Length in seconds.
  double length() const { return secondsAt(reader_.end()); }

  struct TimedMessage {
    double time = 0;              // s from the start of the recording
    v1::ServerMessage message{};  // message as sent
    bool isFrame() const { return message.has_frame(); }
    codec::PacketHeader header{};  // set for a frame
  };
  struct Lost {
    double start = 0, end = 0;  // s
    std::string reason;
  };
  struct End {};
  using Next = std::variant<End, TimedMessage, Lost>;

  // Returns the next message, loss or end.
  [[nodiscard]] Next next();
  // next() continues with the newest key frame at or before this time, or else with the first message.
  void seek(double seconds);
  // All parameters after every change up to this time.
  ParametersInForce parametersAt(double seconds);

 private:
  RecordedStream(RecordingReader reader, v1::StreamDescription description, FrameCheck check);
  double secondsAt(std::uint64_t time) const;
  std::uint64_t timeAt(double seconds) const;
  // Only a key frame can follow.
  void restart();
  void lose(double from, std::string reason);
  // nullopt if the message is not played.
  std::optional<TimedMessage> timedMessage(const RecordedMessage& message);
  std::optional<TimedMessage> frame(const RecordedMessage& message);

  RecordingReader reader_;
  v1::StreamDescription description_;
  ParameterHistory parameters_;
  std::string scene_;
  FrameCheck check_;
  std::optional<std::uint64_t> newest_;  // tick of the previous frame; absent: only a key frame can follow
  std::optional<Lost> lost_;             // loss that next() has not returned yet
  std::optional<TimedMessage> held_;     // message after the loss
};

}  // namespace clothstream::recording
