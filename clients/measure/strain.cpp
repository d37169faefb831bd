// SPDX-License-Identifier: MIT
#include "clients/measure/strain.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace clothstream::measure {
namespace {

double lengthOf(std::span<const float> positions, std::uint32_t a, std::uint32_t b) {
  const Point from = pointAt(positions, a), to = pointAt(positions, b);
  return std::hypot(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
}

}  // namespace

std::vector<Edge> structuralEdges(const Surface& surface, const Cloth& cloth) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
  for (std::uint32_t row = 0; row < cloth.rows; ++row)
    for (std::uint32_t column = 0; column < cloth.columns; ++column) {
      const std::uint32_t vertex = cloth.firstVertex + row * cloth.columns + column;
      if (column + 1 < cloth.columns) pairs.emplace_back(vertex, vertex + 1);
      if (row + 1 < cloth.rows) pairs.emplace_back(vertex, vertex + cloth.columns);
    }
  if (cloth.rows == 0) {
    for (std::size_t i = 0; i < cloth.triangleCount; ++i) {
      const Triangle& triangle = surface.triangles[cloth.firstTriangle + i];
      for (std::size_t k = 0; k < 3; ++k)
        pairs.emplace_back(std::minmax({triangle[k], triangle[(k + 1) % 3]}));
    }
    std::ranges::sort(pairs);
    pairs.erase(std::ranges::unique(pairs).begin(), pairs.end());
  }
  std::vector<Edge> edges;
  for (const auto& [a, b] : pairs)
    if (const double rest = lengthOf(surface.rest, a, b); rest > 0) edges.push_back({a, b, rest});
  return edges;
}

std::vector<double> strainsOf(std::span<const Edge> edges, std::span<const float> positions) {
  std::vector<double> strains;
  strains.reserve(edges.size());
  for (const Edge& edge : edges) strains.push_back(lengthOf(positions, edge.a, edge.b) / edge.rest - 1);
  return strains;
}

StrainFigures figuresOf(std::vector<double> strains) {
  if (strains.empty()) return {};
  StrainFigures figures;
  for (double& strain : strains) {
    strain = std::abs(strain);
    figures.mean += strain / static_cast<double>(strains.size());
  }
  constexpr double kPart = 0.99;
  const auto place = static_cast<std::ptrdiff_t>(kPart * static_cast<double>(strains.size() - 1));
  std::ranges::nth_element(strains, strains.begin() + place);
  figures.p99 = strains[static_cast<std::size_t>(place)];
  figures.largest = std::ranges::max(strains);
  return figures;
}

}  // namespace clothstream::measure
