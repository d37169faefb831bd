// SPDX-License-Identifier: MIT
// Surfaces of fabrics as texels: colour, normal and roughness of one tile that repeats without a seam. The
// same as clients/web/three/src/weave.ts.
#pragma once

#include <cstdint>
#include <vector>

#include "clients/xr/stage/fabrics.h"

namespace clothstream::xr {

// Threads along each edge of a tile. A multiple of the period of every pattern: 2, 4, 5 and 10.
inline constexpr std::uint32_t kThreads = 40;

struct WeaveTexels {
  // 4 bytes per texel. Colour in sRGB: factor of the fabric's colour, 1 at 200; alpha is 255.
  std::vector<std::uint8_t> colours;
  // X and Y of the normal, around 127.5; 255; factor of the roughness.
  std::vector<std::uint8_t> reliefs;
};

// `size`: texels along each edge.
WeaveTexels weave(const Fabric& fabric, std::uint32_t size);

}  // namespace clothstream::xr
