// SPDX-License-Identifier: MIT
// Comparison of poses.
#pragma once

#include "server/model/pose.h"

namespace clothstream::model {

// Whether the numbers of both are equal. A rotation has two quaternions, which differ here.
inline bool isSame(const Pose& a, const Pose& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

}  // namespace clothstream::model
