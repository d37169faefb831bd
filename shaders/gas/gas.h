// SPDX-License-Identifier: MIT
// Tables of the kernels of gas inside closed cloths. C++ and GLSL use the same layout.
#ifndef CLOTHSTREAM_SHADERS_GAS_GAS_H
#define CLOTHSTREAM_SHADERS_GAS_GAS_H

#include "shaders/collision/collision.h"
#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

// What a node contributes: two texels.
#define CLOTHSTREAM_GAS_SHARE_TEXELS 2

// One cloth with gas. Pressures are fractions of the pressure outside, volumes of the volume at rest.
struct GasPush {
  CollisionPush collision;
  uint32_t cloth;
  uint32_t firstNode;  // in the scene
  uint32_t nodeCount;
  uint32_t firstRecord;  // of its nodes among those of all closed meshes
  float atRest;          // pressure at the volume at rest
  float perVolume;       // 1 / volume at rest, 1/m^3
  float response;        // h^2 * pressure outside / volume at rest, kg/m^4
  float squaredSubstep;  // h^2, s^2
  float impulse;         // h * pressure outside, N s/m^2
  float substepSeconds;
  uint32_t reserved0;
  uint32_t reserved1;
};

CLOTHSTREAM_SHARED_END

#ifdef __cplusplus
namespace clothstream::shared {
static_assert(sizeof(GasPush) == 80);
}  // namespace clothstream::shared
#endif

#endif
