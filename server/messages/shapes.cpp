// SPDX-License-Identifier: MIT
// Converts and checks shapes.
#include "server/messages/shapes.h"

#include <cmath>
#include <memory>
#include <utility>

#include <fmt/format.h>

#include "server/messages/limits.h"
#include "server/messages/solid_message.h"
#include "server/messages/vectors.h"

namespace clothstream::messages {
namespace {

// Allowed sizes, which differ between scenes and participants.
struct Sizes {
  Range radius, length, size;
};
constexpr Sizes kOfScene{limits::kRadius, limits::kShapeLength, limits::kShapeSize};
constexpr Sizes kOfParticipant{limits::kParticipantRadius, limits::kParticipantLength,
                               limits::kParticipantSize};

model::Shape toSphere(Checks& checks, const Path& path, const v1::Sphere& message, const Sizes& sizes) {
  return model::Sphere{checks.number(path / "radius", message.radius(), sizes.radius)};
}

model::Shape toCapsule(Checks& checks, const Path& path, const v1::Capsule& message, const Sizes& sizes) {
  model::Capsule capsule{.radius = checks.number(path / "radius", message.radius(), sizes.radius),
                         .length = checks.number(path / "length", message.length(), sizes.length)};
  if (message.has_top_radius())
    capsule.topRadius = checks.number(path / "topRadius", message.top_radius(), sizes.radius);
  checkEnds(checks, path / "topRadius", capsule);
  return capsule;
}

model::Shape toBox(Checks& checks, const Path& path, const v1::Box& message, const Sizes& sizes) {
  return model::Box{toVec3(checks, path / "size", message.size(), sizes.size)};
}

model::Shape toHull(Checks& checks, const Path& path, const v1::ConvexHull& message) {
  const auto count = [&](std::string_view field, int elements) {
    checks.count(path / field, static_cast<std::size_t>(elements), limits::kMinHullParts,
                 limits::kMaxHullParts);
  };
  count("vertices", message.vertices_size());
  count("faces", message.faces_size());
  if (checks.failed()) return {};
  std::vector<model::Vec3> vertices;
  vertices.reserve(static_cast<std::size_t>(message.vertices_size()));
  for (int i = 0; i < message.vertices_size(); ++i)
    vertices.push_back(toVec3(checks, path.at("vertices", i), message.vertices(i), limits::kPosition));
  std::vector<std::vector<std::uint32_t>> faces;
  for (int i = 0; i < message.faces_size(); ++i) {
    const v1::Face& face = message.faces(i);
    const Path corners = path.at("faces", i);
    checks.count(corners / "vertices", static_cast<std::size_t>(face.vertices_size()), 3,
                 limits::kMaxHullParts);
    faces.emplace_back(face.vertices().begin(), face.vertices().end());
  }
  if (checks.failed()) return {};
  auto made = model::makeConvexHull(std::move(vertices), std::move(faces));
  if (const auto* problem = std::get_if<model::HullProblem>(&made)) {
    if (problem->face)
      checks.fail(path.at("faces", static_cast<int>(*problem->face)), "", problem->text);
    else
      checks.fail(path, "", problem->text);
    return {};
  }
  return std::make_shared<const model::ConvexHull>(std::get<model::ConvexHull>(std::move(made)));
}

// Writes a shape to any message that has the shape fields.
template <typename Message>
void writeSimple(const model::Shape& shape, Message& message) {
  std::visit(model::ShapeVisitor{
                 [&](const model::Sphere& sphere) { message.mutable_sphere()->set_radius(sphere.radius); },
                 [&](const model::Capsule& capsule) {
                   v1::Capsule& to = *message.mutable_capsule();
                   to.set_radius(capsule.radius);
                   to.set_length(capsule.length);
                   to.clear_top_radius();
                   if (capsule.topRadius) to.set_top_radius(*capsule.topRadius);
                 },
                 [&](const model::Plane&) { message.mutable_plane(); },
                 [&](const model::Box& box) { write(box.size, *message.mutable_box()->mutable_size()); },
                 [&](const model::Hull&) { message.clear_shape(); },
                 [&](const model::Solid&) { message.clear_shape(); }},
             shape);
}

}  // namespace

model::Shape toShape(Checks& checks, const Path& path, const v1::Collider& message,
                     const MeshReader& readMesh) {
  switch (message.shape_case()) {
    case v1::Collider::kSphere:
      return toSphere(checks, path / "sphere", message.sphere(), kOfScene);
    case v1::Collider::kCapsule:
      return toCapsule(checks, path / "capsule", message.capsule(), kOfScene);
    case v1::Collider::kPlane:
      return model::Plane{};
    case v1::Collider::kBox:
      return toBox(checks, path / "box", message.box(), kOfScene);
    case v1::Collider::kHull:
      return toHull(checks, path / "hull", message.hull());
    case v1::Collider::kMesh:
      if (model::Solid solid = toSolid(checks, path / "mesh", message.mesh(), readMesh)) return solid;
      return {};
    case v1::Collider::SHAPE_NOT_SET:
      break;
  }
  checks.fail(path, "",
              "has no shape; must have \"sphere\", \"capsule\", \"plane\", \"box\", \"hull\" or \"mesh\"");
  return {};
}

model::Shape toShape(Checks& checks, const Path& path, const v1::ParticipantCollider& message) {
  switch (message.shape_case()) {
    case v1::ParticipantCollider::kSphere:
      return toSphere(checks, path / "sphere", message.sphere(), kOfParticipant);
    case v1::ParticipantCollider::kCapsule:
      return toCapsule(checks, path / "capsule", message.capsule(), kOfParticipant);
    case v1::ParticipantCollider::kBox:
      return toBox(checks, path / "box", message.box(), kOfParticipant);
    case v1::ParticipantCollider::SHAPE_NOT_SET:
      break;
  }
  checks.fail(path, "", "has no shape; must have \"sphere\", \"capsule\" or \"box\"");
  return {};
}

void checkEnds(Checks& checks, const Path& path, const model::Capsule& capsule) {
  if (!capsule.topRadius ||
      std::abs(*capsule.topRadius - capsule.radius) <= model::kMostSlope * capsule.length)
    return;
  checks.fail(path, fmt::format("{}", *capsule.topRadius),
              fmt::format("must differ from \"radius\" by at most {} times \"length\", because one end would "
                          "be inside the other; use a sphere",
                          model::kMostSlope));
}

void write(const model::Shape& shape, v1::Collider& message) {
  writeSimple(shape, message);
  if (const auto* hull = std::get_if<model::Hull>(&shape)) writeHull(**hull, *message.mutable_hull());
  if (std::holds_alternative<model::Solid>(shape)) message.mutable_mesh();
}

void write(const model::Shape& shape, v1::ColliderState& message) {
  writeSimple(shape, message);
}

void write(const model::Shape& shape, v1::AppliedCollider& message) {
  writeSimple(shape, message);
}

void writeHull(const model::ConvexHull& hull, v1::ConvexHull& message) {
  message.Clear();
  for (const model::Vec3& vertex : hull.vertices) write(vertex, *message.add_vertices());
  for (const std::vector<std::uint32_t>& face : hull.faces)
    message.add_faces()->mutable_vertices()->Assign(face.begin(), face.end());
}

}  // namespace clothstream::messages
