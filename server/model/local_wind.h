// SPDX-License-Identifier: MIT
// Local winds: fans and vortices, which move the air around them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>

#include "server/model/pose.h"

namespace clothstream::model {

// With the fade f(s) = (1 - s)^2 for 0 <= s < 1 and 0 beyond, a local wind gives the air at a point the
// velocity below, in addition to that of the scene's environment and of the other local winds. `axis` is the
// unit vector to which the pose turns +Y, r the point relative to the pose's position, z = axis . r, and
// d = r - z axis. Both fields are continuous everywhere, and their speed is at most `speed`. A kernel takes
// the velocity at the middle of each triangle (shaders/mass_spring/local_wind.glsl), and so does the
// reference.

// Fan that blows along the axis:  speed f((z / range)^2) f(|d|^2 / R^2) axis  with R = radius + spread z.
// Behind the fan, where z < 0, R is the radius, and so is the range.
struct Fan {
  float radius = 0.15f;  // m, of the opening
  float spread = 0.2f;   // m of radius for each m of distance: the tangent of the cone's half-angle
  float range = 3;       // m, at least the radius
};

// Vortex around the axis:  speed 2 q / (1 + q^2) f(|r|^2 / reach^2) t  with q = |d| / radius and the unit
// vector t along axis x r. Kaufmann 1962, Scully 1975, without the fade. Without it the speed at the core's
// radius is `speed`.
struct Vortex {
  float radius = 0.3f;  // m, of the core
  float reach = 2;      // m, at least the radius
};

struct LocalWind {
  Pose pose = {};
  float speed = 0;  // m/s
  std::variant<Fan, Vortex> kind = Fan{};
};

// Local wind of a scene.
struct SceneWind : LocalWind {
  std::string name;
};

// Local wind that a participant holds.
struct HeldWind : LocalWind {
  std::uint32_t id = 0;  // unique for this participant; the same id moves the same wind
};

// Largest number of local winds in a tick, of the scene and its participants together.
inline constexpr std::size_t kMaxLocalWinds = 8;

// Unit vector.
Vec3 axisOf(const LocalWind& wind);

// Bound on the speed of the air that these winds move together, m/s: the sum of their speeds.
template <typename Winds>
float speedOf(const Winds& winds) {
  float sum = 0;
  for (const LocalWind& wind : winds) sum += wind.speed;
  return sum;
}

// Velocity that these winds give the air at a point, m/s, in double precision.
Eigen::Vector3d velocityAt(std::span<const LocalWind> winds, const Eigen::Vector3d& point);

}  // namespace clothstream::model
