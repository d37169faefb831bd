// SPDX-License-Identifier: MIT
// Results of a codec for a motion, in bytes, metres, degrees and milliseconds.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "proto/codec/stream_layout.h"
#include "tests/bench/codec/frame_codec.h"
#include "tests/bench/samples.h"
#include "tests/bench/suite.h"

namespace clothstream::bench {

// Measures one codec over a motion. A normal's error is the decoded unit vector minus the true one; in
// degrees it is the angle between the two. Flicker is the root mean square, over vertices and frames, of the
// change of that error since the previous frame, as an angle.
class CodecMeasurement {
 public:
  CodecMeasurement(std::unique_ptr<FrameCodec> codec, const codec::ClothLayout& cloth, double maxError);

  // Throws std::runtime_error if a decoded position is farther from the true one than promised.
  void add(const TrueFrame& frame);

  // Requires at least one frame. A suite appends further values.
  nlohmann::ordered_json row(const std::string& motion) const;

 private:
  void addErrors(const TrueFrame& frame, std::span<const float> decoded);
  void addNormals(const TrueFrame& frame, std::span<const float> decoded);

  std::unique_ptr<FrameCodec> codec_;
  codec::StreamLayout layout_;  // for computing normals
  double maxError_;
  Samples bytes_, encode_, decode_, normalErrors_;
  std::vector<float> normals_, normalError_, normalErrorBefore_;
  double largest_ = 0, errorSum_ = 0, normalErrorSum_ = 0, flickerSum_ = 0, calmFlickerSum_ = 0;
  std::size_t frames_ = 0, keyBytes_ = 0, calm_ = 0;
};

// Frames of a motion with their true normals and calm vertices.
class Truth {
 public:
  explicit Truth(const codec::ClothLayout& cloth);
  // Valid until the next call.
  TrueFrame next(std::span<const float> positions);

 private:
  codec::StreamLayout layout_;
  std::uint32_t frame_ = 0;
  std::vector<float> before_, normals_;
  std::vector<std::uint8_t> calm_;
};

}  // namespace clothstream::bench
