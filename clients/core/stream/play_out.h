// SPDX-License-Identifier: MIT
// Keeps the newest frames and computes what to show at a time. See cs_play_out_options in core.h.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/stream/play_out_delay.h"
#include "clients/core/wire/description.h"

namespace clothstream::client {

// Whether the version is known and each number is within its limits.
bool isAllowed(const cs_play_out_options& options);

struct DisplayableFrame {
  std::uint64_t tick = 0;
  std::uint64_t timeUs = 0;  // start of the tick
  bool key = false;
  std::span<const float> positions, normals;  // 3 floats per vertex; normals only if the stream sends them
  std::span<const Collider> colliders = {};
};

// All times are microseconds of the server's clock. Times of frames are not trusted: any number is allowed.
// Memory for a frame is allocated when first needed; a full ring allocates no more.
class PlayOut {
 public:
  static constexpr std::size_t kMaxBytes = 256 * 1024 * 1024, kFewestFrames = 3;

  explicit PlayOut(const cs_play_out_options& options) : options_(options) {}

  // Starts a stream. Forgets all frames.
  void begin(const Description& description);
  // Adds a frame with a larger tick. If its time is not larger, all earlier frames are forgotten, because the
  // server's time has changed. displayableUs is when the frame was decoded; 0 if the server's clock is
  // unknown.
  void add(const DisplayableFrame& frame, std::uint64_t displayableUs);

  // Chooses what to show. Both times are 0 if the server's clock is unknown.
  cs_played play(std::uint64_t nowUs, std::uint64_t displayUs);
  // Whether the last play() chose a frame or an interpolation. The functions below require it.
  bool shows() const { return shown_.base != nullptr; }
  std::span<const float> positions() const;
  std::span<const float> normals(const codec::StreamLayout& layout);
  const std::vector<Collider>& colliders();

  // Fills in the members about play-out.
  void report(cs_stage_statistics& out) const;

 private:
  struct Frame {
    std::uint64_t tick = 0, timeUs = 0;
    bool key = false;
    std::vector<float> positions, normals;
    std::vector<Collider> colliders;
  };
  // Result: base + fraction * (to - from). A fraction of 0 means the base itself.
  struct Shown {
    const Frame *base = nullptr, *from = nullptr, *to = nullptr;
    double fraction = 0;
  };

  void forget();
  std::size_t held() const;
  const Frame& newest(std::size_t back) const;
  cs_shown choose(std::uint64_t timeUs);
  cs_shown chooseBeyond(const Frame& frame, double pastUs);
  void blend(std::vector<float> Frame::*values, std::vector<float>& out) const;
  void moveColliders();

  cs_play_out_options options_;
  double frameUs_ = 0;  // nominal time between frames of the stream
  bool sendsNormals_ = false;
  std::vector<Frame> frames_;  // ring buffer
  std::size_t count_ = 0;      // frames added; the newest are in the ring

  PlayOutDelay delay_;
  bool plays_ = false;                        // whether the delay and the two times below are set
  std::uint64_t displayUs_ = 0, timeUs_ = 0;  // last play(): display time, and display time minus delay

  Shown shown_;
  std::vector<float> positions_, normals_;  // interpolated or computed values
  std::vector<Collider> colliders_;
  // Whether normals_ and colliders_ are up to date.
  bool hasNormals_ = false, hasColliders_ = false;

  std::uint64_t lateFrames_ = 0;
  double ledOnUs_ = 0, heldUs_ = 0;
};

}  // namespace clothstream::client
