// SPDX-License-Identifier: MIT
// Renders triangles on the CPU, with depth, one lamp with shadows, and a floor at y = 0.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/mesh.h"
#include "server/model/pose.h"
#include "tests/bench/picture/picture.h"

namespace clothstream::bench {

struct View {
  model::Vec3 eye, target;
  float height;               // metres that the picture shows at the target
  std::uint32_t width, rows;  // pixels
};

// A smooth surface of which both sides are drawn.
struct Surface {
  std::vector<model::Vec3> positions;
  std::vector<model::Triangle> triangles;
  model::Vec3 front, back;  // colours, 0 to 1; the front is where triangles are counter-clockwise
  // One (u, v) for each position, or empty. A thin line is drawn at every whole number.
  std::vector<Eigen::Vector2f> lines;
};

Surface sphereSurface(const model::Vec3& centre, float radius, const model::Vec3& colour);

Picture render(const View& view, std::span<const Surface> surfaces);

}  // namespace clothstream::bench
