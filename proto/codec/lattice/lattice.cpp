// SPDX-License-Identifier: MIT
// Positions on a lattice of integers.
#include "proto/codec/lattice/lattice.h"

namespace clothstream::codec {

LatticeScale latticeScale(float maxError) {
  const double widest = 2.0 * static_cast<double>(maxError) - 0x1p-18;
  float step = static_cast<float>(widest);
  if (static_cast<double>(step) > widest) step = std::nextafter(step, 0.0f);
  return {step, static_cast<float>(1.0 / static_cast<double>(step))};
}

}  // namespace clothstream::codec
