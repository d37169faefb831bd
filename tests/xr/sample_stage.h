// SPDX-License-Identifier: MIT
// A stage with a sheet of cloth, without a server.
#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "clients/xr/stage/fabrics.h"
#include "clients/xr/stage/topology.h"

namespace clothstream::xr::tests {

// Square sheet of `side` by `side` nodes, 1 m wide, in the plane z = 0, from y = 0.5 to 1.5.
inline Stage sampleStage(std::uint32_t side) {
  Stage stage;
  std::vector<std::uint32_t> corners;
  for (std::uint32_t row = 0; row < side; ++row) {
    for (std::uint32_t column = 0; column < side; ++column) {
      const float step = 1.0f / static_cast<float>(side - 1);
      stage.positions.push_back(static_cast<float>(column) * step - 0.5f);
      stage.positions.push_back(1.5f - static_cast<float>(row) * step);
      stage.positions.push_back(0);
      if (row + 1 == side || column + 1 == side) continue;
      const std::uint32_t p = row * side + column;
      corners.insert(corners.end(), {p, p + side, p + side + 1, p, p + side + 1, p + 1});
    }
  }
  stage.topology = 1;
  append({.firstNode = 0,
          .nodeCount = side * side,
          .rows = side,
          .columns = side,
          .positions = stage.positions,
          .corners = corners,
          .uvs = {},
          .uvIndices = {}},
         stage);
  stage.clothNodeCount = stage.nodeCount;
  stage.frames.emplace_back();
  MeshPart part{.firstIndex = 0, .indexCount = static_cast<std::uint32_t>(corners.size())};
  part.surface = surfaceOf("silk", 0);
  part.surface.woven = true;
  stage.parts.push_back(part);
  stage.centre = {0, 1, 0};
  stage.radius = 0.9f;
  return stage;
}

// Moves the sheet along z in waves.
inline void wave(Stage& stage, float phase) {
  for (std::size_t i = 0; i + 2 < stage.positions.size(); i += 3)
    stage.positions[i + 2] = 0.05f * std::sin(8 * stage.positions[i] + phase);
}

}  // namespace clothstream::xr::tests
