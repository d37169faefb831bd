// SPDX-License-Identifier: MIT
// The look of each material of the server, as the page has it (clients/web/three/src/fabrics.ts).
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "clients/xr/stage/stage.h"

namespace clothstream::xr {

// How the threads of a fabric cross, or what its surface has instead of threads.
enum class Pattern : std::uint32_t { kPlain, kTwill, kSatin, kRipstop, kGrain, kFibres, kStipple };

struct Fabric {
  std::string_view material;  // name of server/model/material.cpp
  Pattern pattern = Pattern::kPlain;
  float pitch =
      0.0016F;  // distance of neighbouring threads, m; larger than real ones, so that a headset resolves them
  std::uint32_t colour = 0;  // sRGB; 0: the fabric is dyed, in a different colour for each cloth
  float weft = 0.94F;        // brightness of the weft compared with the warp; above 1 the weft is also paler
  float variation = 0.06F;   // spread of the brightness of threads, as a fraction
  float reverse = 1;         // brightness of the back compared with the front
  float roughness = 0.86F, relief = 0.8F;
  float sheen = 0.3F, sheenRoughness = 0.5F;
  float translucency = 0.2F;  // part of the light from behind that shines through, 0 to 1
};

// All fabrics. The first one is that of a cloth without a material. Surface::weave is an index in this list.
std::span<const Fabric> fabrics();

// Surface of a material. `dye` selects the colour of dyed fabrics. A material that is not in the list looks
// like cotton.
Surface surfaceOf(std::string_view material, std::uint32_t dye);

}  // namespace clothstream::xr
