// SPDX-License-Identifier: MIT
// The parameters that hold at some time of a recorded stream.
#include "server/recording/parameters_in_force.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include "server/messages/scene_message.h"
#include "server/model/scene.h"

namespace clothstream::recording {
namespace {

using google::protobuf::FieldDescriptor;

// m²; 0 where it cannot be told.
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

// What is set replaces what was there: a vector in whose message a zero is not written, too. But of these
// what is not given stays.
bool isInParts(const FieldDescriptor& field) {
  return field.name() == "self_collision" || field.name() == "tethers";
}

void overwrite(const google::protobuf::Message& with, google::protobuf::Message& all) {
  std::vector<const FieldDescriptor*> fields;
  with.GetReflection()->ListFields(with, &fields);
  for (const FieldDescriptor* field : fields)
    if (!field->is_repeated() && !isInParts(*field)) all.GetReflection()->ClearField(&all, field);
  all.MergeFrom(with);
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
  v1::ParameterChange environment = change;
  environment.clear_cloths();
  environment.clear_colliders();
  overwrite(environment, now_);
  for (const v1::ClothChange& told : change.cloths())
    for (v1::ClothChange& cloth : *now_.mutable_cloths())
      if (told.name().empty() || told.name() == cloth.name()) {
        const std::string name = cloth.name();
        overwrite(told, cloth);
        cloth.set_name(name);
      }
}

}  // namespace clothstream::recording
