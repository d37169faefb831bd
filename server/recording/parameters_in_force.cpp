// SPDX-License-Identifier: MIT
// The parameters that hold at some time of a recorded stream.
#include "server/recording/parameters_in_force.h"

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include "server/scene/scene.h"

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
    scene::Vec3 at(0, 0, 0);
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
  const v1::Environment& environment = scene.environment();
  *now_.mutable_gravity()->mutable_value() = environment.gravity();
  *now_.mutable_wind()->mutable_value() = environment.wind();
  now_.set_air_density(environment.air_density());
  *now_.mutable_gust() = environment.gust();
  for (int i = 0; i < scene.cloths_size() && i < description.cloths_size(); ++i) {
    const v1::Cloth& cloth = scene.cloths(i);
    v1::ClothChange& all = *now_.add_cloths();
    all.set_name(cloth.name());
    if (const double area = areaOf(cloth, description.cloths(i)); area > 0)
      all.set_areal_mass(static_cast<float>(double{cloth.mass()} / area));
    if (!cloth.material().empty()) all.set_material(cloth.material());
    *all.mutable_structural() = cloth.structural();
    *all.mutable_shear() = cloth.shear();
    *all.mutable_bend() = cloth.bend();
    all.set_damping(cloth.damping());
    all.set_drag(cloth.drag());
    all.set_lift(cloth.lift());
    all.set_friction(cloth.friction());
    all.set_thickness(cloth.thickness());
    *all.mutable_solver() = cloth.solver();
    all.set_dihedral_bending(cloth.dihedral_bending());
    if (cloth.has_self_collision()) *all.mutable_self_collision() = cloth.self_collision();
    if (cloth.has_tethers()) *all.mutable_tethers() = cloth.tethers();
  }
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
