// SPDX-License-Identifier: MIT
#include "server/meshes/repairs.h"

#include <string_view>

#include <fmt/format.h>

namespace clothstream::meshes {
namespace {

// "1 face was", "2 faces were".
std::string counted(std::uint32_t count, std::string_view one, std::string_view several) {
  return fmt::format("{} {} {}", count, count == 1 ? one : several, count == 1 ? "was" : "were");
}

std::string shown(const model::Vec3& size) {
  return fmt::format("{:.3g} x {:.3g} x {:.3g} m", size.x(), size.y(), size.z());
}

}  // namespace

bool Repairs::isEmpty() const {
  return triangulatedFaces == 0 && droppedFaces == 0 && droppedDuplicates == 0 && splitEdges == 0 &&
         splitVertices == 0 && turnedTriangles == 0 && cutEdges == 0 && fittedScale == 0;
}

std::vector<std::string> Repairs::sentences() const {
  std::vector<std::string> text;
  if (fittedScale != 0 && fittedScale != 1)
    text.push_back(
        fmt::format("The mesh was {} large. It was scaled by {:.3g} to {}, and its middle moved to the "
                    "origin of its pose.",
                    shown(sizeBefore), fittedScale, shown(sizeAfter)));
  if (fittedScale == 1) text.emplace_back("The middle of the mesh was moved to the origin of its pose.");
  if (triangulatedFaces > 0)
    text.push_back(counted(triangulatedFaces, "polygon", "polygons") +
                   " divided into triangles: a face has three corners, or four if it is convex.");
  if (droppedFaces > 0)
    text.push_back(counted(droppedFaces, "face without an area", "faces without an area") + " dropped.");
  if (droppedDuplicates > 0)
    text.push_back(counted(droppedDuplicates, "triangle with the corners of another",
                           "triangles with the corners of another") +
                   " dropped.");
  if (splitEdges > 0)
    text.push_back(
        counted(splitEdges, "edge with more than two triangles", "edges with more than two triangles") +
        " split: at most two triangles of an edge are still joined.");
  if (turnedTriangles > 0)
    text.push_back(
        counted(turnedTriangles, "triangle", "triangles") +
        " turned, so that neighbours have their fronts on one side, and closed surfaces theirs outside.");
  if (cutEdges > 0)
    text.push_back(counted(cutEdges, "edge", "edges") +
                   " cut, because no turning gives the triangles there one front, as on a Moebius strip.");
  if (splitVertices > 0)
    text.push_back(fmt::format(
        "{} divided, which added {}.",
        counted(splitVertices, "vertex where several sheets met", "vertices where several sheets met"),
        addedVertices == 1 ? std::string("1 vertex") : fmt::format("{} vertices", addedVertices)));
  return text;
}

}  // namespace clothstream::meshes
