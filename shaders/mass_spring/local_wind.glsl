// SPDX-License-Identifier: MIT
// Velocity of the air in local winds. server/model/local_wind.h has the equations.
#ifndef CLOTHSTREAM_SHADERS_MASS_SPRING_LOCAL_WIND_GLSL
#define CLOTHSTREAM_SHADERS_MASS_SPRING_LOCAL_WIND_GLSL

#include "shaders/mass_spring/local_wind.h"
#include "shaders/shared/arithmetic.glsl"

// True if the tick has a local wind.
layout(constant_id = 9) const bool kLocalWinds = false;

layout(binding = kLocalWindBinding) uniform samplerBuffer localWinds;  // LocalWindRecord

float fade(float share) {
  precise float left = max(1.0 - share, 0.0);
  precise float faded = left * left;
  return faded;
}

// `from` is the place relative to the fan.
vec3 fanVelocity(LocalWindRecord fan, vec3 from) {
  float along = dotProduct(fan.axis, from);
  precise vec3 away = from - along * fan.axis;
  precise float radius = fan.size + fan.spread * max(along, 0.0);
  float inverse = reciprocal(radius);
  precise float outward = dotProduct(away, away) * (inverse * inverse);
  precise float part = along * (along > 0.0 ? fan.reach : fan.behind);
  precise float forward = part * part;
  precise vec3 velocity = (fan.speed * fade(forward) * fade(outward)) * fan.axis;
  return velocity;
}

// `from` is the place relative to the vortex.
vec3 vortexVelocity(LocalWindRecord vortex, vec3 from) {
  vec3 around = crossProduct(vortex.axis, from);
  precise float square = 1.0 + dotProduct(around, around) * vortex.size;
  precise float share = dotProduct(from, from) * vortex.reach;
  precise vec3 velocity = (vortex.speed * reciprocal(square) * fade(share)) * around;
  return velocity;
}

// Velocity that the first `count` local winds give the air at a place, m/s.
vec3 localWindAt(vec3 place, uint count) {
  precise vec3 velocity = vec3(0.0);
  for (uint i = 0; i < count; ++i) {
    LocalWindRecord wind = localWindRecordAt(localWinds, i);
    precise vec3 from = place - wind.position;
    if (wind.kind == CLOTHSTREAM_VORTEX) {
      velocity = velocity + vortexVelocity(wind, from);
    } else {
      velocity = velocity + fanVelocity(wind, from);
    }
  }
  return velocity;
}

#endif
