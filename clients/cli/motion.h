// SPDX-License-Identifier: MIT
// Motion of cloths from a recording or from arrays of numpy.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/cli/error.h"
#include "clients/measure/penetration.h"
#include "clients/measure/surface.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

struct MotionFrame {
  std::uint64_t tick = 0;
  double seconds = 0;                // simulated time: tick / rate
  std::span<const float> positions;  // metres, 3 floats per vertex; valid until the next frame
};

// Frames in the order of their ticks. Errors name the file.
class Motion {
 public:
  virtual ~Motion() = default;

  // Continues to the next frame. Returns false at the end.
  [[nodiscard]] virtual tl::expected<bool, Error> next() = 0;
  virtual const MotionFrame& frame() const = 0;
  // Colliders of the newest frame; empty for arrays, which have none.
  virtual std::vector<measure::Solid> solids() const { return {}; }

  virtual const measure::Surface& surface() const = 0;
  virtual double rate() const = 0;           // ticks per second
  virtual std::uint64_t frames() const = 0;  // number of frames, or more if some cannot be decoded
  // Largest error of a coordinate, metres; 0: positions are exact.
  virtual double maxError() const { return 0; }
  // Gravity and the mass of each cloth at the start, if the file has them; m/s^2 and kg.
  virtual std::optional<measure::Point> gravity() const { return std::nullopt; }
  virtual std::optional<double> massOf(std::size_t) const { return std::nullopt; }
};

// Facts that a file of arrays may lack.
struct ArrayOptions {
  std::string mesh;                    // OBJ file with the cloth at rest; empty: the arrays have it
  std::optional<double> rate;          // frames per second; absent: the arrays have it
  std::optional<std::uint64_t> first;  // tick of the first frame; absent: of the arrays, otherwise 1
};

[[nodiscard]] tl::expected<std::unique_ptr<Motion>, Error> openRecordedMotion(
    const std::string& path, const recording::ReadLimits& limits);
// Refuses more than `maxVertices` vertices, or twice as many triangles, before it reads them.
[[nodiscard]] tl::expected<std::unique_ptr<Motion>, Error> openArrays(const std::string& path,
                                                                      const ArrayOptions& options,
                                                                      std::uint32_t maxVertices);
// Chooses by the name: .npz is a file of arrays, any other one a recording.
[[nodiscard]] tl::expected<std::unique_ptr<Motion>, Error> openMotion(const std::string& path,
                                                                      const ArrayOptions& options,
                                                                      const recording::ReadLimits& limits);

}  // namespace clothstream::cli
