// SPDX-License-Identifier: MIT
// Contact of four nodes with the moving sphere: shaders/collision/contact.glsl and collide.glsl for one
// sphere.
#pragma once

#include <cmath>

#include "tests/bench/offload/cloth.h"

namespace clothstream::bench::offload {

// shaders/collision/collision.h.
constexpr float kDepthRounding = 2.4e-7f;

// One node that may touch. Positions are relative to the sphere's centre at the start and at the end. Returns
// whether it was moved.
inline bool collideOne(const Ball& ball, const Settings& settings, const float* before, float* after,
                       float* velocity) {
  const float radius = settings.reach;
  const auto dot3 = [](const float* a, const float* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; };
  const auto unit = [&](const float* v, float* out) {
    const float squared = dot3(v, v);
    const float inverse = squared < 1e-24f ? 0 : 1 / std::sqrt(squared);
    for (int i = 0; i < 3; ++i) out[i] = squared < 1e-24f ? (i == 1 ? 1.0f : 0.0f) : v[i] * inverse;
  };
  const float beforeSquared = dot3(before, before), afterSquared = dot3(after, after);
  const bool begunInside = beforeSquared <= radius * radius;
  float normal[3], outwards[3];
  if (begunInside) {
    unit(before, normal);
  } else {
    float path[3], entry[3];
    for (int i = 0; i < 3; ++i) path[i] = after[i] - before[i];
    const float squared = beforeSquared - radius * radius, along = dot3(before, path);
    const float discriminant = along * along - dot3(path, path) * squared;
    if (along >= 0 || discriminant < 0) return false;
    const float part = squared / (std::sqrt(discriminant) - along);
    if (part > 1) return false;
    for (int i = 0; i < 3; ++i) entry[i] = before[i] + part * path[i];
    unit(entry, normal);
  }
  unit(after, outwards);
  float depth = 0;
  if (dot3(normal, outwards) > 0 && afterSquared < radius * radius) {
    for (int i = 0; i < 3; ++i) normal[i] = outwards[i];
    depth = radius - dot3(after, outwards);
  } else if (dot3(normal, outwards) > 0 && begunInside) {
    return false;
  } else {
    depth = radius - dot3(normal, after);
  }
  if (depth <= 0) return false;
  float speed[3], path[3], extents = 0;
  for (int i = 0; i < 3; ++i) {
    after[i] += depth * normal[i];
    extents += std::fabs(after[i]) + std::fabs(after[i] + ball.after[i]);
    speed[i] = velocity[i] - ball.velocity[i];
    path[i] = after[i] - before[i];
  }
  const float approach = dot3(speed, normal);
  for (int i = 0; i < 3; ++i) speed[i] -= std::fmin(approach, 0.0f) * normal[i];
  const float pressed = (depth - kDepthRounding * extents) / settings.substep - std::fmax(approach, 0.0f);
  const float most = settings.friction * std::fmax(std::fmax(-approach, pressed), 0.0f);
  // Friction takes at most `limit` of the part of a vector along the surface.
  const auto rub = [&](float* vector, float limit) {
    const float across = dot3(vector, normal);
    float along[3];
    for (int i = 0; i < 3; ++i) along[i] = vector[i] - across * normal[i];
    const float taken = std::fmin(limit / std::sqrt(std::fmax(dot3(along, along), 1e-30f)), 1.0f);
    for (int i = 0; i < 3; ++i) vector[i] -= taken * along[i];
  };
  rub(speed, most);
  rub(path, settings.substep * most);
  for (int i = 0; i < 3; ++i) {
    velocity[i] = ball.velocity[i] + speed[i];
    after[i] = before[i] + path[i];
  }
  return true;
}

// The lanes of four nodes that may touch. Writes those that do, so that the caller's vectors stay in
// registers.
[[gnu::noinline]] inline void collideNear(const Ball& ball, const Settings& settings, Mask near,
                                          const Triple& before, const Triple& after, const Triple& velocity,
                                          std::size_t at, Pointers positions, Pointers velocities) {
  for (std::size_t lane = 0; lane < 4; ++lane) {
    if (near[lane] == 0) continue;
    const float start[3] = {before.x[lane], before.y[lane], before.z[lane]};
    float place[3] = {after.x[lane], after.y[lane], after.z[lane]};
    float speed[3] = {velocity.x[lane], velocity.y[lane], velocity.z[lane]};
    if (!collideOne(ball, settings, start, place, speed)) continue;
    positions.x[at + lane] = place[0] + ball.after[0];
    positions.y[at + lane] = place[1] + ball.after[1];
    positions.z[at + lane] = place[2] + ball.after[2];
    velocities.x[at + lane] = speed[0];
    velocities.y[at + lane] = speed[1];
    velocities.z[at + lane] = speed[2];
  }
}

// Stores four nodes that come from `from`, moved out of the sphere. Lanes outside `free` do not collide. Most
// vectors leave after the first comparison, which holds only if |after| > reach + |path| (a^2 > 2 (b^2 + c^2)
// is stricter than a > b + c).
[[gnu::always_inline]] inline void storeOutside(const Ball& ball, const Settings& settings, Mask free,
                                                const Triple& from, const Triple& position,
                                                const Triple& velocity, std::size_t at, Pointers positions,
                                                Pointers velocities) {
  positions.set(at, position);
  velocities.set(at, velocity);
  const Triple after = position - Triple{splat(ball.after[0]), splat(ball.after[1]), splat(ball.after[2])};
  const Triple before = from - Triple{splat(ball.before[0]), splat(ball.before[1]), splat(ball.before[2])};
  const Triple path = after - before;
  const Lanes distanceSquared = dot(after, after), pathSquared = dot(path, path);
  const Lanes limit = splat(2.001f) * (splat(settings.reach * settings.reach) + pathSquared);
  if (!any((distanceSquared <= limit) & free)) return;
  const Mask near =
      (squareRoot(distanceSquared) <= splat(1.0001f) * (splat(settings.reach) + squareRoot(pathSquared))) &
      free;
  if (any(near)) collideNear(ball, settings, near, before, after, velocity, at, positions, velocities);
}

}  // namespace clothstream::bench::offload
