// SPDX-License-Identifier: MIT
// Decodes the frames of a recording and compares each with its recorded hash.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "proto/codec/decoder.h"
#include "proto/recording/frame_faults.h"

namespace clothstream::recording {

// Safe on any bytes. Not thread-safe.
class FrameCheck {
 public:
  // The error says that the stream is not possible.
  [[nodiscard]] static tl::expected<FrameCheck, std::string> make(const codec::StreamLayout& layout);

  enum class Outcome : std::uint8_t {
    decoded,
    repeated,  // the same frame as the one before; nothing is missing
    // It cannot be decoded, or differs from its hash. Without such frames the stream is whole: later frames
    // that refer to one are faulty, too. Counted in faults().
    faulty,
  };
  // Takes the next serialised Frame. `seconds` is its time since the start of the recording.
  Outcome take(std::string_view frame, double seconds);
  // Forgets all frames, for a seek: a key frame with any tick may follow. Counts continue.
  void restart();
  // The same, and counts start again.
  void clear();

  const FrameFaults& faults() const { return faults_; }
  // Describes the newest faulty frame.
  const std::string& reason() const { return reason_; }
  const codec::Decoder& decoder() const { return *decoder_; }

 private:
  explicit FrameCheck(std::unique_ptr<codec::Decoder> decoder) : decoder_(std::move(decoder)) {}

  std::unique_ptr<codec::Decoder> decoder_;
  FrameFaults faults_;
  std::string reason_;
};

}  // namespace clothstream::recording
