// SPDX-License-Identifier: MIT
// Depth of vertices below the surface of a solid.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "clients/core/core.h"
#include "clients/measure/surface.h"

namespace clothstream::measure {

// Collider with its pose, and the faces of a hull.
class Solid {
 public:
  // `corners` and `triangles` are those of cs_get_hull; they are empty for other shapes.
  Solid(const cs_collider& collider, std::span<const float> corners,
        std::span<const std::uint32_t> triangles);

  // Distance of a point to the nearest place of the surface, metres: positive inside, 0 or negative outside.
  // For a hull it is the distance to the nearest plane of a face. For a mesh, every triangle is tested if the
  // point is in the mesh's box.
  double depthOf(const Point& point) const;

 private:
  struct Face {
    Point normal;  // unit length, outwards
    double offset = 0;
  };

  double depthInMesh(const Point& p) const;

  std::uint32_t shape_ = 0;
  double radius_ = 0, halfLength_ = 0;
  double slope_ = 0;  // of a capsule's radius along its length
  Point position_{}, halfSize_{};
  std::array<double, 4> orientation_{};          // quaternion x y z w, unit length
  std::vector<Face> faces_;                      // of a hull
  std::vector<std::array<Point, 3>> triangles_;  // of a mesh
  Point low_{}, high_{};                         // corners of the mesh's box
};

// All colliders of the newest frame.
std::vector<Solid> solidsOf(const cs_client* client);

// Largest depth of the vertices `first` to `first` + `count` - 1 in any of the solids, metres; 0 if none is
// inside.
double penetrationOf(std::span<const Solid> solids, std::span<const float> positions, std::uint32_t first,
                     std::uint32_t count);

}  // namespace clothstream::measure
