// SPDX-License-Identifier: MIT
// The newest frames, and what to show of them at a time: see cs_play_out_options in core.h.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/wire/description.h"

namespace clothstream::client {

// Whether the version is known and each number within its bounds.
bool isAllowed(const cs_play_out_options& options);

struct DisplayableFrame {
  std::uint64_t tick = 0;
  std::uint64_t timeUs = 0;  // when the tick began
  bool key = false;
  std::span<const float> positions, normals;  // 3 a vertex; normals where the stream sends them
  std::span<const Collider> colliders = {};
};

// All times are microseconds of the server's clock; those of frames may be any numbers. It takes memory for a
// frame when it first needs it, and none any more once it has been full.
class PlayOut {
 public:
  static constexpr std::size_t kMostBytes = 256 * 1024 * 1024, kFewestFrames = 3;

  explicit PlayOut(const cs_play_out_options& options) : options_(options) {}

  // A stream begins: what there was is forgotten.
  void begin(const Description& description);
  // Ticks grow. Where their time does not, the frames before are forgotten: it is another time from here on.
  // `displayableUs` is when the frame was decoded; 0: the server's clock is not known.
  void add(const DisplayableFrame& frame, std::uint64_t displayableUs);

  // Chooses what is shown. Of a server's clock that is not known, both times are 0.
  cs_played play(std::uint64_t nowUs, std::uint64_t displayUs);
  // Whether play() chose a frame, or one between two; what follows is defined only then.
  bool shows() const { return shown_.base != nullptr; }
  std::span<const float> positions() const;
  std::span<const float> normals(const codec::StreamLayout& layout);
  const std::vector<Collider>& colliders();

  // Fills in what is of play-out.
  void report(cs_stage_statistics& out) const;

 private:
  static constexpr std::size_t kSamples = 256;
  static constexpr double kPercentile = 0.98, kSlew = 0.05;

  struct Frame {
    std::uint64_t tick = 0, timeUs = 0;
    bool key = false;
    std::vector<float> positions, normals;
    std::vector<Collider> colliders;
  };
  // base + fraction * (to - from); with a fraction of 0 the base itself.
  struct Shown {
    const Frame *base = nullptr, *from = nullptr, *to = nullptr;
    double fraction = 0;
  };

  void forget();
  std::size_t held() const;
  const Frame& newest(std::size_t back) const;
  void sample(double neededUs);
  void moveDelay(double aheadUs, double elapsedUs);
  cs_shown choose(std::uint64_t timeUs);
  cs_shown chooseBeyond(const Frame& frame, double pastUs);
  void blend(std::vector<float> Frame::*values, std::vector<float>& out) const;
  void moveColliders();

  cs_play_out_options options_;
  double frameUs_ = 0;  // between frames of the stream where none is missing
  bool sendsNormals_ = false;
  std::vector<Frame> frames_;  // a ring
  std::size_t count_ = 0;      // that came; the newest of them are held

  // How long after the tick before it each of the newest frames could be displayed: with this delay it comes
  // when its turn begins.
  std::array<double, kSamples> samples_{}, sorted_{};
  std::size_t sampleCount_ = 0;
  double neededUs_ = 0;  // the percentile of these
  double delayUs_ = 0, wantedUs_ = 0;
  bool plays_ = false;                        // since then there are the delay and, of the newest play():
  std::uint64_t displayUs_ = 0, timeUs_ = 0;  // the display time, the same less the delay

  Shown shown_;
  std::vector<float> positions_, normals_;  // of what is no frame's own
  std::vector<Collider> colliders_;
  // In normals_ and colliders_, of what is shown.
  bool hasNormals_ = false, hasColliders_ = false;

  std::uint64_t lateFrames_ = 0;
  double ledOnUs_ = 0, heldUs_ = 0;
};

}  // namespace clothstream::client
