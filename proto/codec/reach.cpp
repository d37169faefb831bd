// SPDX-License-Identifier: MIT
// Range of the coordinates that a stream holds.
#include "proto/codec/reach.h"

#include <algorithm>
#include <cmath>

#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

using hierarchical::kMaxWanted;

float reachOf(float maxError) {
  const double perUnit = hierarchical::quantisationScale(hierarchical::latticeUnit(maxError).unit);
  auto reach = static_cast<float>(kMaxWanted / perUnit);
  while (double{reach} * perUnit > kMaxWanted) reach = std::nextafter(reach, 0.0f);
  return reach;
}

// A coarser quality may have more bits in a step, and then a smaller reach.
float reachOf(float maxError, std::uint8_t qualities) {
  float reach = reachOf(maxError);
  for (std::uint8_t quality = 1; quality < qualities; ++quality)
    reach = std::min(reach, reachOf(maxErrorOf(maxError, quality)));
  return reach;
}

float maxErrorFor(float distance) {
  // Steps have all of their bits from 40 m on. A larger max error then has a larger reach.
  const double unit = std::max(double{distance}, 40.0) / kMaxWanted;
  const double error = unit * hierarchical::kUnitsInMaxError + 0x1p-19;
  double micrometres = std::ceil(1e6 * error);
  while (reachOf(static_cast<float>(1e-6 * micrometres)) < distance)
    micrometres = std::ceil(1.000001 * micrometres);
  return static_cast<float>(1e-6 * micrometres);
}

double promisedDistance(float maxError, float coordinate) {
  // A decoded float is rounded twice, each time by at most 2^-24 of it. latticeUnit() leaves 2^-19 m for
  // that.
  const double rounding = std::max(0.0, std::abs(double{coordinate}) * 0x1p-23 - 0x1p-19);
  return std::sqrt(3.0) * (double{maxError} + rounding);
}

float farthestOf(std::span<const float> positions) {
  float farthest = 0;
  for (const float coordinate : positions) farthest = std::max(farthest, std::abs(coordinate));
  return farthest;
}

}  // namespace clothstream::codec
