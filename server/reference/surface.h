// SPDX-License-Identifier: MIT
// Contact of a path with surfaces of the real room, in double precision. It tests every triangle.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include "server/model/surface.h"
#include "server/reference/contact.h"

namespace clothstream::reference {

// A surface that stands still in a tick.
struct PlacedSurface {
  std::shared_ptr<const model::Surface> surface;
  Pose pose = {};
  bool twoSided = false;
  double friction = 1;  // multiplied with the cloth's
};

struct SurfaceContact {
  Eigen::Vector3d normal;
  double depth = 0;
  std::size_t surface = 0;  // index
};

// The contact at the end of a path: that of its first crossing, or else the one that pushes farthest.
// `seconds`: of the substep, in which a surface pushes a node that it finds too near by at most
// kSurfacePushSpeed.
std::optional<SurfaceContact> touchSurfaces(std::span<const PlacedSurface> surfaces, double thickness,
                                            double seconds, const Eigen::Vector3d& from,
                                            const Eigen::Vector3d& to);

// Whether the path crosses a surface: from either side if it has two, else from its front.
bool crossesSurfaces(std::span<const PlacedSurface> surfaces, const Eigen::Vector3d& from,
                     const Eigen::Vector3d& to);

}  // namespace clothstream::reference
