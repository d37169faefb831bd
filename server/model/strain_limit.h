// SPDX-License-Identifier: MIT
// The strain at which ACAD begins to hold a spring.
#pragma once

#include "server/model/scene.h"

namespace clothstream::model {

// Part of the activation at which AcadMode::limit holds springs. A spring that is held is slightly longer
// than its limit, by its multiplier's compliance and by the rounds that a solve has.
inline constexpr float kLimitShare = 0.92f;

// Strain from which a spring is a constraint.
inline float heldStrain(const Solver& solver) {
  return isAcad(solver, AcadMode::limit) ? kLimitShare * solver.activation : solver.activation;
}

}  // namespace clothstream::model
