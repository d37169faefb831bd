// SPDX-License-Identifier: MIT
#include "clients/xr/stage/fabrics.h"

#include <array>
#include <cmath>

namespace clothstream::xr {
namespace {

constexpr std::array<Fabric, 8> kFabrics{{
    {.material = "cotton"},
    {.material = "denim",
     .pattern = Pattern::kTwill,
     .pitch = 0.002F,
     .colour = 0x2b4264,
     .weft = 1.9F,
     .variation = 0.26F,
     .reverse = 1.7F,
     .roughness = 0.92F,
     .relief = 1,
     .sheen = 0.2F,
     .translucency = 0.03F},
    {.material = "flag_nylon",
     .pattern = Pattern::kRipstop,
     .pitch = 0.0014F,
     .weft = 1,
     .variation = 0.04F,
     .roughness = 0.5F,
     .relief = 0.6F,
     .sheen = 0.15F,
     .translucency = 0.38F},
    {.material = "leather",
     .pattern = Pattern::kGrain,
     .pitch = 0.003F,
     .colour = 0x7a4a2b,
     .variation = 0.12F,
     .reverse = 1.25F,
     .roughness = 0.52F,
     .relief = 0.9F,
     .sheen = 0,
     .translucency = 0},
    {.material = "paper",
     .pattern = Pattern::kFibres,
     .pitch = 0.002F,
     .colour = 0xe9e4d8,
     .variation = 0.03F,
     .roughness = 0.95F,
     .relief = 0.25F,
     .sheen = 0,
     .translucency = 0.3F},
    {.material = "rubber",
     .pattern = Pattern::kStipple,
     .pitch = 0.002F,
     .colour = 0x34363b,
     .variation = 0.02F,
     .roughness = 0.45F,
     .relief = 0.25F,
     .sheen = 0,
     .translucency = 0},
    {.material = "silk",
     .pattern = Pattern::kSatin,
     .pitch = 0.0009F,
     .weft = 0.8F,
     .variation = 0.07F,
     .reverse = 0.86F,
     .roughness = 0.38F,
     .relief = 0.3F,
     .sheen = 0.55F,
     .sheenRoughness = 0.35F,
     .translucency = 0.3F},
    {.material = "wool",
     .pattern = Pattern::kTwill,
     .pitch = 0.0024F,
     .weft = 0.86F,
     .variation = 0.16F,
     .roughness = 0.95F,
     .relief = 0.7F,
     .sheen = 0.8F,
     .sheenRoughness = 0.7F,
     .translucency = 0.06F},
}};

// Madder, indigo, ochre, moss, plum and linen. Their brightness differs too, for colour-blind viewers.
constexpr std::array<std::uint32_t, 6> kDyes{0x84161f, 0x1c4f7c, 0xb87f22, 0x47693a, 0x6a3f80, 0xb5a98c};

float linear(std::uint32_t byte) {
  const float value = static_cast<float>(byte & 0xFFU) / 255.0F;
  return value <= 0.04045F ? value / 12.92F : std::pow((value + 0.055F) / 1.055F, 2.4F);
}

}  // namespace

std::span<const Fabric> fabrics() {
  return kFabrics;
}

Surface surfaceOf(std::string_view material, std::uint32_t dye) {
  std::uint32_t index = 0;
  for (std::uint32_t i = 0; i < kFabrics.size(); ++i)
    if (kFabrics[i].material == material) index = i;
  const Fabric& fabric = kFabrics[index];
  Surface surface;
  surface.colour = fromSrgb(fabric.colour != 0 ? fabric.colour : kDyes[dye % kDyes.size()]);
  surface.roughness = fabric.roughness;
  surface.sheen = fabric.sheen;
  surface.sheenRoughness = fabric.sheenRoughness;
  surface.reverse = fabric.reverse;
  surface.translucency = fabric.translucency;
  surface.relief = fabric.relief;
  surface.weave = index;
  return surface;
}

Colour fromSrgb(std::uint32_t rgb) {
  return {linear(rgb >> 16), linear(rgb >> 8), linear(rgb)};
}

}  // namespace clothstream::xr
