// SPDX-License-Identifier: MIT
// Applies recorded changes of parameters.
#include "server/recording/parameters_in_force.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "server/messages/scene_message.h"
#include "server/model/scene.h"

namespace clothstream::recording {
namespace {

// Area in m²; 0 if it is unknown.
double areaOf(const v1::Cloth& cloth, const v1::ClothDescription& described) {
  if (cloth.has_grid()) return double{cloth.grid().width()} * double{cloth.grid().height()};
  const std::string &positions = described.rest_positions(), &triangles = described.triangles();
  const auto corner = [&](std::size_t i) {
    std::uint32_t vertex = 0;
    std::memcpy(&vertex, triangles.data() + i * sizeof vertex, sizeof vertex);
    model::Vec3 at(0, 0, 0);
    if (vertex < positions.size() / sizeof at)
      std::memcpy(at.data(), positions.data() + vertex * sizeof at, sizeof at);
    return at;
  };
  double area = 0;
  for (std::size_t i = 0; i + 3 <= triangles.size() / sizeof(std::uint32_t); i += 3)
    area += 0.5 * double{(corner(i + 1) - corner(i)).cross(corner(i + 2) - corner(i)).norm()};
  return area;
}

}  // namespace

ParametersInForce::ParametersInForce(const v1::StreamDescription& description) {
  if (!description.has_definition()) return;
  const v1::Scene& scene = description.definition();
  std::vector<double> areas;
  for (int i = 0; i < std::min(scene.cloths_size(), description.cloths_size()); ++i)
    areas.push_back(areaOf(scene.cloths(i), description.cloths(i)));
  now_ = messages::allParameters(scene, areas);
}

void ParametersInForce::apply(const v1::ParameterChange& change) {
  messages::applyChange(change, now_);
}

}  // namespace clothstream::recording
