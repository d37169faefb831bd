// SPDX-License-Identifier: MIT
// Strain of edges: their length relative to that at rest.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "clients/measure/surface.h"

namespace clothstream::measure {

struct Edge {
  std::uint32_t a = 0, b = 0;  // vertices
  double rest = 0;             // length at rest, metres; above 0
};

// Edges that resist stretching: along rows and columns of a grid, and all edges of the triangles of a mesh.
// Edges without a length at rest are left out.
std::vector<Edge> structuralEdges(const Surface& surface, const Cloth& cloth);

// Length / rest - 1 of each edge; negative where it is compressed. `positions` has 3 floats per vertex.
std::vector<double> strainsOf(std::span<const Edge> edges, std::span<const float> positions);

// Figures over the absolute values of strains; 0 without strains.
struct StrainFigures {
  double mean = 0, p99 = 0, largest = 0;
};
StrainFigures figuresOf(std::vector<double> strains);

}  // namespace clothstream::measure
