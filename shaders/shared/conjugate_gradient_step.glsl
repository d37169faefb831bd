// SPDX-License-Identifier: MIT
// Step length and direction of an iteration of conjugate gradients ([Va21] Eq. 12-17), in the form that needs
// all its sums at once (Chronopoulos and Gear, "s-step iterative methods for symmetric linear systems", 1989,
// s = 1).
#ifndef CLOTHSTREAM_SHADERS_SHARED_CONJUGATE_GRADIENT_STEP_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_CONJUGATE_GRADIENT_STEP_GLSL

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

// Decides from the square of the residual's norm whether to take another step. With `normOnly`, no step
// follows and the residual is only measured.
SolveRecord measured(SolveRecord solve, float square, ClothRecord cloth, bool normOnly) {
  if (solve.iterations == 0) {
    solve.start = square;
  }
  precise float ratio = square * reciprocal(max(solve.start, 1e-30));
  precise float residual = ratio * reciprocalSquareRoot(max(ratio, 1e-30));
  solve.residual = ratio > 1e-30 ? residual : 0.0;
  solve.arrived &= 0xFFFF0000;
  precise float enough = max(solve.start * cloth.squaredTolerance, 1e-30);
  solve.running = !normOnly && square > enough && solve.iterations < uint(cloth.solverIterations) ? 1 : 0;
  return solve;
}

// Takes a step. `sums` are residual . z and z . A z, with z the preconditioned residual.
SolveRecord stepped(SolveRecord solve, vec2 sums) {
  bool first = solve.iterations == 0;
  precise float directionShare = first ? 0.0 : sums.x * reciprocal(max(solve.square, 1e-30));
  precise float gained = first ? 0.0 : directionShare * (sums.x * reciprocal(max(solve.stepLength, 1e-30)));
  precise float curvature = sums.y - gained;
  precise float stepLength = sums.x * reciprocal(max(curvature, 1e-30));
  solve.square = sums.x;
  solve.directionShare = directionShare;
  solve.stepLength = stepLength;
  ++solve.iterations;
  return solve;
}

#endif
