// SPDX-License-Identifier: MIT
// Applies recorded changes of parameters.
#include "server/recording/parameters_in_force.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include "proto/parameters/cloth_parameters.h"
#include "server/messages/scene_message.h"
#include "server/model/scene.h"

namespace clothstream::recording {
namespace {

using google::protobuf::FieldDescriptor;

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

// True if a change leaves what it does not give: a group that the table keeps. Every other field is replaced
// as a whole, so that a zero, which is not on the wire, replaces too.
bool isKept(const FieldDescriptor& field) {
  const auto number = static_cast<std::uint32_t>(field.number());
  return field.containing_type() == v1::ClothChange::descriptor() &&
         std::ranges::any_of(parameters::kClothParameters, [&](const parameters::ClothParameter& parameter) {
           return parameter.group != nullptr && parameter.group->field.inChange == number &&
                  !parameter.group->isReplaced;
         });
}

void overwrite(const google::protobuf::Message& with, google::protobuf::Message& all) {
  std::vector<const FieldDescriptor*> fields;
  with.GetReflection()->ListFields(with, &fields);
  for (const FieldDescriptor* field : fields)
    if (!field->is_repeated() && !isKept(*field)) all.GetReflection()->ClearField(&all, field);
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
  for (const v1::ClothChange& clothChange : change.cloths())
    for (v1::ClothChange& cloth : *now_.mutable_cloths())
      if (clothChange.name().empty() || clothChange.name() == cloth.name()) {
        const std::string name = cloth.name();
        overwrite(clothChange, cloth);
        cloth.set_name(name);
      }
}

}  // namespace clothstream::recording
