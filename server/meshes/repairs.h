// SPDX-License-Identifier: MIT
// Report of what was repaired in a mesh.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/model/springs.h"

namespace clothstream::meshes {

struct Repairs {
  std::uint32_t triangulatedFaces = 0;  // faces with more than four corners, and quads that were not convex
  std::uint32_t droppedFaces = 0;       // faces without an area
  std::uint32_t droppedDuplicates = 0;  // triangles with the nodes of an earlier one
  std::uint32_t splitEdges = 0;         // edges that more than two triangles had
  std::uint32_t splitVertices = 0;      // vertices at which several sheets of faces met
  std::uint32_t addedVertices = 0;      // copies of these
  std::uint32_t turnedTriangles = 0;
  std::uint32_t cutEdges = 0;  // edges across which no turning gives both triangles the same front
  // Result of MeshOptions::fit. The scale is 0 if the mesh was neither scaled nor moved.
  double fittedScale = 0;
  model::Vec3 sizeBefore = model::Vec3::Zero(),
              sizeAfter = model::Vec3::Zero();  // m, along the axes of the mesh

  bool isEmpty() const;
  // One sentence for each kind of repair, for people.
  std::vector<std::string> sentences() const;
};

}  // namespace clothstream::meshes
