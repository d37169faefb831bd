// SPDX-License-Identifier: MIT
// The scene that a load test creates.
#pragma once

#include <cstdint>

#include "clothstream/v1/scene.pb.h"

namespace clothstream::load {

// Number of nodes of a created scene, which its server may limit further, and its ticks per second.
inline constexpr std::uint32_t kLeastNodes = 4, kMostNodes = 1 << 20, kLeastRate = 10, kMostRate = 1000;

// One sheet of a square metre that hangs by two corners in a light wind, so that it never rests. Its grid has
// about `nodes` nodes and about as many rows as columns. The springs are as stiff as the ten substeps of a
// tick bear. `rate` is that of ticks and of frames, 1/s. The scene has no name.
v1::Scene hungScene(std::uint32_t nodes, std::uint32_t rate);

}  // namespace clothstream::load
