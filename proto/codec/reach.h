// SPDX-License-Identifier: MIT
// Range of the coordinates that a stream holds, and the error that it promises.
#pragma once

#include <cstdint>
#include <span>

namespace clothstream::codec {

// Largest distance along each axis from StreamLayout::origin, in metres, that packets with this max error
// hold: 2^27 units, less a margin for residuals. An encoder clamps positions beyond it, so callers refuse
// them first. At least 40 m.
float reachOf(float maxError);
// The same for all qualities of a stream.
float reachOf(float maxError, std::uint8_t qualities);
// Max error, in whole micrometres, from which on streams hold this distance.
float maxErrorFor(float distance);

// Largest distance of a decoded vertex from its true position, in metres, if no coordinate of it is beyond
// `coordinate`: sqrt(3) max errors. Beyond 16 m the rounding of decoded floats is added.
double promisedDistance(float maxError, float coordinate);
// Largest magnitude of a coordinate; 0 without positions.
float farthestOf(std::span<const float> positions);

}  // namespace clothstream::codec
