// SPDX-License-Identifier: MIT
// The fourth-order Runge-Kutta method, composed of steps of explicit Euler E_c(y) = y + c h f(y), which the
// kernels of the forces compute:
//   y1 = E_1/2(y0),  y2 = y0 + E_1/2(y1) - y1,  y3 = y0 + E_1(y2) - y2,
//   y  = y0 + ((y1 - y0) + 2 (y2 - y0) + (y3 - y0)) / 3 + E_1/6(y3) - y3.
// Each step leads from one of two states to the other. This kernel updates both after step kStage of four.
#version 450
#extension GL_GOOGLE_include_directive : require

const int kColliderBinding = 1;
const int kStateBinding = 3;
const int kContactImpulseBinding = 12;

#include "shaders/shared/simulation.h"

layout(local_size_x_id = 0) in;
layout(constant_id = 1) const uint kStage = 1;

layout(binding = 0) uniform samplerBuffer cloths;  // ClothRecord

#include "shaders/shared/end_of_substep.glsl"

// `positions` and `velocities` are the state before the step; these are the state after it.
layout(std430, binding = 6) buffer NextPositions {
  vec4 nextPositions[];
};
layout(std430, binding = 7) buffer NextVelocities {
  vec4 nextVelocities[];
};
// y0 (`start`), and the weighted sum of the differences of y1, y2 and y3 from y0 (`sums`).
layout(std430, binding = 8) buffer Start {
  vec4 start[];
};
layout(std430, binding = 9) buffer StartVelocities {
  vec4 startVelocities[];
};
layout(std430, binding = 10) buffer Sums {
  vec4 sums[];
};
layout(std430, binding = 11) buffer VelocitySums {
  vec4 velocitySums[];
};

layout(push_constant) uniform Push {
  RungeKuttaPush push;
};

void main() {
  uint index = push.firstNode + gl_GlobalInvocationID.x;
  if (gl_GlobalInvocationID.x >= push.count) {
    return;
  }
  vec4 from = positions[index];
  precise vec3 step_ = nextPositions[index].xyz - from.xyz;
  precise vec3 velocityStep = nextVelocities[index].xyz - velocities[index].xyz;
  if (kStage == 1) {
    start[index] = from;
    startVelocities[index] = velocities[index];
    sums[index].xyz = step_;
    velocitySums[index].xyz = velocityStep;
    return;
  }
  vec3 origin = start[index].xyz;
  vec3 originVelocity = startVelocities[index].xyz;
  if (kStage == 4) {
    precise vec3 position = origin + (sums[index].xyz * 0.33333334 + step_);
    precise vec3 velocity = originVelocity + (velocitySums[index].xyz * 0.33333334 + velocityStep);
    nextPositions[index] = start[index];
    nextVelocities[index] = startVelocities[index];
    endSubstep(index, position, velocity, from.w, push.cloth, push.collision);
    return;
  }
  float weight = kStage == 2 ? 2.0 : 1.0;
  precise vec3 sum = sums[index].xyz + weight * step_;
  precise vec3 velocitySum = velocitySums[index].xyz + weight * velocityStep;
  precise vec3 position = origin + step_;
  precise vec3 velocity = originVelocity + velocityStep;
  sums[index].xyz = sum;
  velocitySums[index].xyz = velocitySum;
  nextPositions[index].xyz = position;
  nextVelocities[index].xyz = velocity;
}
