// SPDX-License-Identifier: MIT
// A recording's stream in the order in which it is played.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/temporal_layers.h"
#include "proto/recording/recording_reader.h"
#include "server/recording/parameter_history.h"
#include "server/recording/parameters_in_force.h"

namespace clothstream::recording {

// Later ticks than this after the one before are of no stream.
inline constexpr std::uint64_t kMaxTickStep = std::uint64_t{1} << 32;

// Frames that can be decoded one after the other, from a key frame on, and what everybody was told between
// them. What cannot be read, or not be decoded any more, is left out and said. Safe on any bytes.
class RecordedStream {
 public:
  // The error names the path and what is wrong with it. Files that were cut off are taken as far as they go.
  // Reads what holds a change of parameters, so that no seek has to.
  [[nodiscard]] static tl::expected<RecordedStream, std::string> open(const std::string& path);
  [[nodiscard]] static tl::expected<RecordedStream, std::string> of(RecordingReader reader);

  // The stream's, as when the recording began.
  const v1::StreamDescription& description() const { return description_; }
  // Of whose server it is; a name of [a-z0-9_-], "recording" where it has none such.
  const std::string& scene() const { return scene_; }
  const std::string& device() const { return reader_.fact("device"); }
  // Whether its end is missing.
  bool cut() const { return !reader_.mcap().indexed(); }
  // s
  double length() const { return secondsAt(reader_.end()); }

  struct Told {
    double time = 0;              // s from the start of the recording
    v1::ServerMessage message{};  // as it was sent
    bool isFrame() const { return message.has_frame(); }
    codec::PacketHeader header{};  // of a frame
  };
  struct Lost {
    double start = 0, end = 0;  // s
    std::string reason;
  };
  struct End {};
  using Next = std::variant<End, Told, Lost>;

  // What comes next.
  [[nodiscard]] Next next();
  // What comes next is then the newest key frame at this time or before, or else the first message.
  void seek(double seconds);
  // All parameters as they are known to whoever saw everything up to then.
  ParametersInForce parametersAt(double seconds);

 private:
  RecordedStream(RecordingReader reader, v1::StreamDescription description);
  double secondsAt(std::uint64_t time) const;
  std::uint64_t timeAt(double seconds) const;
  void lose(double from, std::string reason);
  // Nothing where it is not to be played.
  std::optional<Told> told(const RecordedMessage& message);
  std::optional<Told> frame(const RecordedMessage& message);

  RecordingReader reader_;
  v1::StreamDescription description_;
  ParameterHistory parameters_;
  std::string scene_;
  std::optional<std::uint64_t> newest_;  // tick of the frame before; nothing: only a key frame can follow
  codec::HeldFrames decoded_;            // while there is a newest one
  bool sought_ = true;                   // and no frame since: what cannot be decoded is not lost
  std::optional<Lost> lost_;             // and not said yet
  std::optional<Told> held_;             // comes after what was lost
};

}  // namespace clothstream::recording
