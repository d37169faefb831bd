// SPDX-License-Identifier: MIT
// Light of the scene: key light with its shadow map, rim light, and the surroundings. The numbers are those
// of the page (clients/web/page/src/studio.ts and sky.ts).
#pragma once

#include <Eigen/Core>

#include "clients/xr/shaders/records.h"
#include "clients/xr/stage/stage.h"

namespace clothstream::xr {

inline constexpr std::uint32_t kShadowTexels = 2048;  // also in shaders/light.glsl

// Fills in what does not depend on the stage: lights, surroundings and exposure.
void setLight(shaders::Frame& frame);

// Fills in the shadow map's matrix, the floor and the colours of the background.
void fitToStage(const Stage& stage, shaders::Frame& frame);

// From the scene to the shadow map: x and y are texture coordinates and z is the depth, 0 to 1 each. It
// covers a sphere and what swings out of it.
Eigen::Matrix4f shadowMatrix(const Eigen::Vector3f& centre, float radius);

// Unit vector from the scene to the key light.
Eigen::Vector3f keyDirection();

}  // namespace clothstream::xr
