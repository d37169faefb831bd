// SPDX-License-Identifier: MIT
// How far an iteration of conjugate gradients goes ([Va21] Eq. 12-17), in the form that needs all its sums at
// once (Chronopoulos and Gear, "s-step iterative methods for symmetric linear systems", 1989, with s = 1).
#ifndef CLOTHSTREAM_SHADERS_SHARED_CONJUGATE_GRADIENT_STEP_GLSL
#define CLOTHSTREAM_SHADERS_SHARED_CONJUGATE_GRADIENT_STEP_GLSL

#include "shaders/shared/arithmetic.glsl"
#include "shaders/shared/simulation.h"

// Whether to take another step, by the square of the residual's norm; `solver`: of the cloth's record.
// `norm`: none is to be taken, the residual is only measured.
SolveRecord measured(SolveRecord solve, float square, vec4 solver, bool norm) {
  if (solve.iterations == 0) {
    solve.start = square;
  }
  precise float ratio = square * reciprocal(max(solve.start, 1e-30));
  precise float residual = ratio * reciprocalSquareRoot(max(ratio, 1e-30));
  solve.residual = ratio > 1e-30 ? residual : 0.0;
  solve.arrived &= 0xFFFF0000;
  precise float enough = max(solve.start * solver.z, 1e-30);
  solve.running = !norm && square > enough && solve.iterations < uint(solver.y) ? 1 : 0;
  return solve;
}

// `sums`: residual . z and z . A z, with z the preconditioned residual.
SolveRecord stepped(SolveRecord solve, vec2 sums) {
  bool first = solve.iterations == 0;
  precise float turn = first ? 0.0 : sums.x * reciprocal(max(solve.square, 1e-30));
  precise float gained = first ? 0.0 : turn * (sums.x * reciprocal(max(solve.stepLength, 1e-30)));
  precise float curvature = sums.y - gained;
  precise float stepLength = sums.x * reciprocal(max(curvature, 1e-30));
  solve.square = sums.x;
  solve.turn = turn;
  solve.stepLength = stepLength;
  ++solve.iterations;
  return solve;
}

#endif
