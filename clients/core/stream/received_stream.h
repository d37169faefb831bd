// SPDX-License-Identifier: MIT
// The stream of a scene as the client receives it: description, frames, reports.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/core/core.h"
#include "clients/core/stream/content_assembly.h"
#include "clients/core/stream/frame_feedback.h"
#include "clients/core/stream/frame_statistics.h"
#include "clients/core/stream/newest_frame.h"
#include "clients/core/stream/play_out.h"
#include "clients/core/stream/server_clock.h"
#include "clients/core/wire/description.h"
#include "clients/core/wire/limits.h"
#include "clients/core/wire/server_message.h"

namespace clothstream::client {

// Decodes each frame that arrives and counts it. Says what to send back; it sends nothing itself.
class ReceivedStream {
 public:
  explicit ReceivedStream(bool isMirror) : newest_(isMirror) {}

  void setClock(std::uint64_t (*nowUs)()) { newest_.setClock(nowUs); }
  Acknowledgements& acknowledgements() { return acknowledgements_; }

  // A connection starts. The description and the newest frame stay.
  void connecting();
  void welcomed();
  // Adds a chunk of the description. Returns whether the description is complete; the stream has then begun.
  // `resumed` says that ticks continue. The error is a sentence.
  [[nodiscard]] tl::expected<bool, std::string> add(const Chunk& chunk, const Limits& limits, bool resumed);
  // Changes the parameters of the description.
  void apply(const ParameterChange& change) { client::apply(change, description_); }

  struct Received {
    bool isNew = false;  // it was decoded; false: it was not needed, or refused
    bool isKey = false;
    bool needsKeyFrame = false;
    bool hasReport = false;
  };
  // Reads a Frame after the stream has begun. The error names the malformed message. A mirror needs what the
  // other client decoded.
  [[nodiscard]] tl::expected<Received, const char*> receive(Bytes body, const cs_decoded* decoded,
                                                            std::uint64_t nowUs);
  // Returns whether to send a request for a key frame now, and counts it as sent. `always`: also while one
  // waits.
  bool takeKeyFrameRequest(std::uint64_t nowUs, bool always);
  // Measures how long the newest frame, which arrived now, was under way.
  void measure(const ServerClock& clock, std::uint64_t nowUs);
  DisplayableFrame displayable(bool isKey) const;
  void operatingPoint(std::uint32_t quality) { quality_ = quality; }

  // Empty before the first description.
  const Description& description() const { return description_; }
  bool begun() const { return newest_.begun(); }
  const NewestFrame& newest() const { return newest_; }
  // Newest frame, or the rest state before the first frame.
  std::span<const float> positions() const;
  std::span<const float> normals() const;
  // Quality that the server sends now; 0 before the description.
  std::uint32_t quality() const { return begun() ? quality_ : 0; }
  // Divisor of the newest frame; 1 before the first.
  std::uint32_t frameDivisor() const { return frameDivisor_; }
  const FrameStatistics& statistics() const { return statistics_; }
  // Members about the newest frame.
  cs_stage_statistics stages() const;
  // The newest report and its tick; no cloths before the first.
  const SimulationReport& report() const { return report_; }
  std::uint64_t reportTick() const { return reportTick_; }

 private:
  Received decode(const cs_decoded* decoded, std::uint64_t nowUs);
  bool readsReport(Bytes body);

  ContentAssembly assembly_;
  Description description_;
  NewestFrame newest_;
  Frame frame_;
  std::uint32_t quality_ = 0;  // from the newest OperatingPoint
  std::uint32_t frameDivisor_ = 1;
  Acknowledgements acknowledgements_;
  KeyFrameRequest keyFrameRequest_;
  FrameStatistics statistics_;
  cs_stage_statistics stages_{};
  SimulationReport report_;
  std::uint64_t reportTick_ = 0;
};

}  // namespace clothstream::client
