// SPDX-License-Identifier: MIT
// Checks messages about surfaces of the real room, and converts them.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"
#include "server/model/closed_mesh.h"
#include "server/model/pose.h"
#include "server/model/surface.h"

namespace clothstream::messages {

// Part of the mesh of a surface.
struct SurfacePart {
  std::uint32_t index = 0, count = 1;
  bool twoSided = false;  // of part 0
  float friction = 1;     // of part 0
};

// A message without its vertices and triangles, which appendTo() adds to a mesh.
struct SurfaceUpdate {
  std::uint32_t id = 0;
  std::optional<model::Pose> pose = {};
  bool remove = false;
  std::optional<SurfacePart> part = {};
  std::optional<std::vector<std::uint32_t>> keep = {};  // ascending; all others are removed
};

// Returns INVALID_ARGUMENT unless the message has a part, or else a pose, or else removes, or else keeps.
[[nodiscard]] Result<SurfaceUpdate> toSurfaceUpdate(const v1::SurfaceUpdate& message);

// Mesh of a surface whose parts arrive. Values are checked by model::makeSurface() when it is complete.
struct SurfaceParts {
  std::vector<model::Vec3> vertices;
  std::vector<model::TriangleCorners> triangles;
};

// Adds what a part has. Returns RESOURCE_EXHAUSTED, and adds nothing, if the mesh then has too many triangles
// or vertices.
[[nodiscard]] Result<void> appendTo(SurfaceParts& parts, const v1::SurfacePart& message);

// The error of a mesh that makeSurface() refuses.
FieldError surfaceError(std::uint32_t id, const model::SurfaceProblem& problem);

}  // namespace clothstream::messages
