// SPDX-License-Identifier: MIT
// Converts parameter changes of clients and checks them against their scene. Applies changes to messages.
#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include "proto/parameters/apply_change.h"
#include "server/messages/client_message.h"
#include "server/messages/cloth_message.h"
#include "server/messages/followed_place.h"
#include "server/messages/limits.h"
#include "server/messages/parameter_numbers.h"
#include "server/messages/scene_message.h"
#include "server/messages/shapes.h"
#include "server/messages/solver_message.h"
#include "server/messages/validation.h"
#include "server/messages/vectors.h"

namespace clothstream::messages {
namespace {

// Cloths that a change with this name addresses. An empty name addresses every cloth.
std::vector<const model::Cloth*> addressed(const model::Scene& scene, const std::string& name) {
  std::vector<const model::Cloth*> cloths;
  for (const model::Cloth& cloth : scene.cloths)
    if (parameters::isFor(name, cloth.name)) cloths.push_back(&cloth);
  return cloths;
}

// Checking, applying and announcing a change takes time for each element and each cloth that it addresses.
void checkAddressed(Checks& checks, const Path& path, const v1::ParameterChange& message,
                    const model::Scene& scene) {
  std::size_t addressed = 0;
  for (const v1::ClothChange& cloth : message.cloths())
    addressed += cloth.name().empty() ? scene.cloths.size() : 1;
  if (addressed > limits::kMaxAddressedCloths)
    checks.fail(path, "",
                fmt::format("address {} cloths together; must be at most {}: set every value of a cloth once",
                            addressed, limits::kMaxAddressedCloths));
}

model::ClothChange toClothChange(Checks& checks, const Path& path, const v1::ClothChange& message,
                                 const model::Scene& scene) {
  model::ClothChange change;
  change.name = message.name();
  if (!change.name.empty()) checkKnown(checks, path / "name", change.name, scene.cloths);
  change.numbers = readNumbers(checks, path, message, addressed(scene, change.name));
  if (message.self_collision().nothing_passes() &&
      !std::ranges::all_of(addressed(scene, change.name),
                           [](const model::Cloth* c) { return model::boundsMotion(*c); }))
    checks.fail(path / "selfCollision" / "nothingPasses", "true",
                "must be absent: it cannot change while the scene runs");
  if (message.has_solver()) change.solver = toSolver(checks, path / "solver", message.solver());
  if (message.has_material() && toMaterial(checks, path / "material", message.material()) != nullptr)
    change.material = message.material();
  if (message.has_areal_mass())
    change.arealMass = checks.number(path / "arealMass", message.areal_mass(), limits::kArealMass);
  return change;
}

// Solvers that the change selects must suit the cloths that get them.
void checkSolvers(Checks& checks, const Path& path, const model::Scene& changed,
                  const model::ParameterChange& change) {
  for (std::size_t i = 0; i < change.cloths.size(); ++i) {
    const model::ClothChange& chosen = change.cloths[i];
    if (!chosen.solver && !chosen.material) continue;
    const Path element = path.at("cloths", static_cast<int>(i));
    for (const model::Cloth* cloth : addressed(changed, chosen.name))
      if (const auto error = unfitSolver(changed, *cloth))
        checks.fail(element / (chosen.solver ? "solver" : "material"), "",
                    fmt::format("\"{}\" {}", cloth->name, *error));
  }
}

// The mass of every cloth that gets another mass per area must be in range.
void checkMasses(Checks& checks, const Path& path, const model::Scene& changed,
                 const model::ParameterChange& change) {
  for (std::size_t i = 0; i < change.cloths.size(); ++i) {
    const model::ClothChange& chosen = change.cloths[i];
    if (!chosen.arealMass && !chosen.material) continue;
    const Path element = path.at("cloths", static_cast<int>(i));
    for (const model::Cloth* cloth : addressed(changed, chosen.name))
      checks.derivedMass(element / (chosen.arealMass ? "arealMass" : "material"),
                         chosen.arealMass ? fmt::format("{}", *chosen.arealMass) : *chosen.material,
                         cloth->mass, model::areaOf(*cloth));
  }
}

// Cloths that get gas must be able to hold it.
void checkPressures(Checks& checks, const Path& path, const model::Scene& changed,
                    const model::ParameterChange& change) {
  for (std::size_t i = 0; i < change.cloths.size() && !checks.failed(); ++i) {
    const model::ClothChange& chosen = change.cloths[i];
    if (!chosen.numbers.has(parameters::ClothNumber::pressure)) continue;
    for (const model::Cloth* cloth : addressed(changed, chosen.name))
      if (const auto error = unfitPressure(changed, *cloth); error && !checks.failed())
        checks.fail(path.at("cloths", static_cast<int>(i)) / "pressure",
                    fmt::format("{}", chosen.numbers[parameters::ClothNumber::pressure]),
                    fmt::format("{} (\"{}\")", *error, cloth->name));
  }
}

model::ColliderChange toColliderChange(Checks& checks, const Path& path, const v1::ColliderChange& message,
                                       const model::Scene& scene) {
  model::ColliderChange change;
  change.name = message.name();
  checkKnown(checks, path / "name", change.name, scene.colliders);
  if (message.has_position())
    change.position = toVec3(checks, path / "position", message.position(), limits::kPosition);
  if (message.has_orientation())
    change.orientation = toQuaternion(checks, path / "orientation", message.orientation());
  if (message.has_friction())
    change.friction = checks.number(path / "friction", message.friction(), limits::kFriction);
  if (checks.failed()) return change;
  const model::Collider& collider = *std::ranges::find(scene.colliders, change.name, &model::Collider::name);
  if (change.position && isFollowed(scene, change.name))
    checkFollowedPlace(checks, path / "position", *change.position, collider.pose.position, scene);
  model::Shape shape = collider.shape;
  const auto needs = [&](const char* field, const std::string& value, bool has, const char* what) {
    if (!has)
      checks.fail(path / field, value, fmt::format("must be absent: \"{}\" is {}", change.name, what));
  };
  if (message.has_radius()) {
    change.radius = checks.number(path / "radius", message.radius(), limits::kRadius);
    needs("radius", fmt::format("{}", *change.radius), model::radiusOf(shape) != nullptr,
          "neither sphere nor capsule");
  }
  if (message.has_length()) {
    change.length = checks.number(path / "length", message.length(), limits::kShapeLength);
    needs("length", fmt::format("{}", *change.length), std::holds_alternative<model::Capsule>(shape),
          "no capsule");
  }
  if (message.has_size()) {
    change.size = toVec3(checks, path / "size", message.size(), limits::kShapeSize);
    needs("size", "", std::holds_alternative<model::Box>(shape), "no box");
  }
  if (auto* capsule = std::get_if<model::Capsule>(&shape)) {
    capsule->radius = change.radius.value_or(capsule->radius);
    capsule->length = change.length.value_or(capsule->length);
    checkEnds(checks, path / "topRadius", *capsule);
  }
  return change;
}

// Every field replaces as a whole, so that a zero, which is not on the wire, replaces too.
void overwrite(const google::protobuf::Message& with, google::protobuf::Message& all) {
  std::vector<const google::protobuf::FieldDescriptor*> fields;
  with.GetReflection()->ListFields(with, &fields);
  for (const auto* field : fields) {
    const bool isKept = field->containing_type() == v1::ClothChange::descriptor() &&
                        !parameters::isReplaced(static_cast<std::uint32_t>(field->number()));
    if (!field->is_repeated() && !isKept) all.GetReflection()->ClearField(&all, field);
  }
  all.MergeFrom(with);
}

void overwriteEnvironment(const v1::ParameterChange& with, v1::ParameterChange& all) {
  v1::ParameterChange environment = with;
  environment.clear_cloths();
  environment.clear_colliders();
  overwrite(environment, all);
}

// Fields of ClothChange that a material sets.
constexpr int kOfMaterials[] = {v1::ClothChange::kStructuralFieldNumber, v1::ClothChange::kShearFieldNumber,
                                v1::ClothChange::kBendFieldNumber,       v1::ClothChange::kDampingFieldNumber,
                                v1::ClothChange::kDragFieldNumber,       v1::ClothChange::kLiftFieldNumber,
                                v1::ClothChange::kFrictionFieldNumber,   v1::ClothChange::kSolverFieldNumber,
                                v1::ClothChange::kArealMassFieldNumber};

// The message with only this field, if it has it.
v1::ClothChange only(const google::protobuf::FieldDescriptor* field, const v1::ClothChange& from) {
  v1::ClothChange part;
  const google::protobuf::Reflection& access = *from.GetReflection();
  if (!access.HasField(from, field)) return part;
  if (field->message_type() == nullptr)
    access.SetFloat(&part, field, access.GetFloat(from, field));
  else
    access.MutableMessage(&part, field)->CopyFrom(access.GetMessage(from, field));
  return part;
}

// Adds `change` with this field of all `cloths`: the most frequent value to `change`, others to `exceptions`,
// which are named and have the order of `cloths`.
void addField(const google::protobuf::FieldDescriptor* field,
              const std::vector<const v1::ClothChange*>& cloths, v1::ClothChange& change,
              std::vector<v1::ClothChange>& exceptions) {
  std::map<std::string, std::size_t> counts;
  std::vector<std::string> values;
  for (const v1::ClothChange* cloth : cloths) {
    values.push_back(only(field, *cloth).SerializeAsString());
    ++counts[values.back()];
  }
  const std::string& usual =
      std::ranges::max_element(counts, {}, [](const auto& each) { return each.second; })->first;
  change.MergeFromString(usual);
  for (std::size_t i = 0; i < values.size(); ++i)
    if (values[i] != usual) exceptions[i].MergeFromString(values[i]);
}

using Addressed = std::vector<const v1::ClothChange*>;

// For each element of `changes`, the elements of `all` for which it has the last material. A later material
// sets everything that an earlier one sets, so only the last one has to be announced with its numbers.
std::vector<Addressed> clothsOfLastMaterials(
    const google::protobuf::RepeatedPtrField<v1::ClothChange>& changes, const v1::ParameterChange& all) {
  Addressed rest;
  for (const v1::ClothChange& cloth : all.cloths()) rest.push_back(&cloth);
  std::vector<Addressed> cloths(static_cast<std::size_t>(changes.size()));
  for (int i = changes.size() - 1; i >= 0; --i) {
    if (!changes[i].has_material()) continue;
    const auto first = std::stable_partition(rest.begin(), rest.end(), [&](const v1::ClothChange* cloth) {
      return !parameters::isFor(changes[i].name(), cloth->name());
    });
    cloths[static_cast<std::size_t>(i)].assign(first, rest.end());
    rest.erase(first, rest.end());
  }
  return cloths;
}

// Overwrites the element with the same name, or adds one.
template <typename Element>
void overwriteNamed(const Element& with, google::protobuf::RepeatedPtrField<Element>& all) {
  const auto known = std::ranges::find(all, with.name(), [](const Element& each) { return each.name(); });
  if (known == all.end())
    *all.Add() = with;
  else
    overwrite(with, *known);
}

}  // namespace

Result<model::ParameterChange> toParameterChange(const v1::ParameterChange& message,
                                                 const model::Scene& scene,
                                                 const model::StabilityBound& bound) {
  Checks checks;
  const Path path("parameterChange");
  model::ParameterChange change;
  change.environment = readNumbers(checks, path, message);
  checks.count(path / "cloths", static_cast<std::size_t>(message.cloths_size()), 0, limits::kMaxCloths);
  checks.count(path / "colliders", static_cast<std::size_t>(message.colliders_size()), 0,
               limits::kMaxColliders);
  checkAddressed(checks, path / "cloths", message, scene);
  for (int i = 0; i < message.cloths_size() && !checks.failed(); ++i)
    change.cloths.push_back(toClothChange(checks, path.at("cloths", i), message.cloths(i), scene));
  for (int i = 0; i < message.colliders_size() && !checks.failed(); ++i)
    change.colliders.push_back(
        toColliderChange(checks, path.at("colliders", i), message.colliders(i), scene));
  if (!checks.failed()) {
    model::Scene changed = scene;
    model::applyChange(changed, change);
    checkSolvers(checks, path, changed, change);
    checkMasses(checks, path, changed, change);
    if (const auto error = unfitBending(changed)) checks.fail(path / "cloths[].dihedralBending", "", *error);
    checkPressures(checks, path, changed, change);
    for (const model::Cloth& cloth : changed.cloths)
      if (const auto error = unfitCoarse(changed, cloth))
        checks.fail(path, "", fmt::format("the coarse correction of \"{}\" {}", cloth.name, *error));
    if (const auto error = instability(changed, bound))
      checks.fail(path, "", fmt::format("with substeps = {}, {}", scene.substeps, *error));
  }
  return std::move(checks).result(std::move(change));
}

v1::ParameterChange withMaterials(v1::ParameterChange change, const model::Scene& changed) {
  if (std::ranges::none_of(change.cloths(), &v1::ClothChange::has_material)) return change;
  std::vector<double> areas;
  for (const model::Cloth& cloth : changed.cloths) areas.push_back(model::areaOf(cloth));
  const v1::ParameterChange all = allParameters(toMessageWithoutMeshes(changed), areas);
  google::protobuf::RepeatedPtrField<v1::ClothChange> cloths;
  cloths.Swap(change.mutable_cloths());
  const std::vector<Addressed> lastMaterials = clothsOfLastMaterials(cloths, all);
  for (int index = 0; index < cloths.size(); ++index) {
    v1::ClothChange& each = cloths[index];
    const Addressed& addressed = lastMaterials[static_cast<std::size_t>(index)];
    std::vector<v1::ClothChange> exceptions(addressed.size());
    if (!addressed.empty())
      for (const int number : kOfMaterials) {
        const auto* field = v1::ClothChange::descriptor()->FindFieldByNumber(number);
        if (!each.GetReflection()->HasField(each, field)) addField(field, addressed, each, exceptions);
      }
    change.add_cloths()->Swap(&each);
    for (std::size_t i = 0; i < exceptions.size(); ++i) {
      if (exceptions[i].ByteSizeLong() == 0) continue;
      exceptions[i].set_name(addressed[i]->name());
      change.add_cloths()->Swap(&exceptions[i]);
    }
  }
  if (static_cast<std::size_t>(change.cloths_size()) <= limits::kMaxCloths) return change;
  v1::ParameterChange merged;  // clients refuse a longer list
  mergeChange(change, merged);
  return merged;
}

void applyChange(const v1::ParameterChange& change, v1::ParameterChange& all) {
  overwriteEnvironment(change, all);
  for (const v1::ClothChange& clothChange : change.cloths())
    for (v1::ClothChange& cloth : *all.mutable_cloths())
      if (parameters::isFor(clothChange.name(), cloth.name())) {
        const std::string name = cloth.name();
        overwrite(clothChange, cloth);
        cloth.set_name(name);
      }
}

void mergeChange(const v1::ParameterChange& next, v1::ParameterChange& earlier) {
  overwriteEnvironment(next, earlier);
  for (const v1::ClothChange& cloth : next.cloths()) {
    // A change of every cloth also overrules the earlier changes of single ones. It stands before them, so
    // that the later changes of single cloths overrule it.
    if (cloth.name().empty()) {
      for (v1::ClothChange& known : *earlier.mutable_cloths()) {
        const std::string name = known.name();
        overwrite(cloth, known);
        known.set_name(name);
      }
      if (earlier.cloths_size() > 0 && earlier.cloths(0).name().empty()) continue;
      *earlier.add_cloths() = cloth;
      for (int i = earlier.cloths_size() - 1; i > 0; --i) earlier.mutable_cloths()->SwapElements(i, i - 1);
    } else {
      overwriteNamed(cloth, *earlier.mutable_cloths());
    }
  }
  for (const v1::ColliderChange& collider : next.colliders())
    overwriteNamed(collider, *earlier.mutable_colliders());
}

}  // namespace clothstream::messages
