// SPDX-License-Identifier: MIT
#include "server/messages/solid_message.h"

#include <bit>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "proto/text/excerpt.h"
#include "proto/text/printable.h"
#include "proto/text/utf8.h"
#include "server/messages/limits.h"
#include "server/messages/skin_message.h"
#include "server/model/distance_grid.h"

namespace clothstream::messages {
namespace {

// Vertices and triangles as the message or the file has them.
struct Surface {
  std::vector<model::Vec3> vertices;
  std::vector<model::TriangleCorners> triangles;
  std::optional<model::Skin> skin;  // of the file
};

void checkCounts(Checks& checks, const Path& path, std::size_t vertices, std::size_t triangles) {
  checks.count(path / "positions", vertices, 4, limits::kMaxSolidVertices);
  checks.count(path / "triangles", triangles, 4, model::kMaxClosedMeshTriangles);
}

Surface ofMessage(Checks& checks, const Path& path, const v1::ColliderMesh& message) {
  if (message.positions_size() % 3 != 0)
    checks.fail(path / "positions", "",
                fmt::format("has {} numbers; must have 3 for each vertex", message.positions_size()));
  if (message.triangles_size() % 3 != 0)
    checks.fail(path / "triangles", "",
                fmt::format("has {} numbers; must have 3 for each triangle", message.triangles_size()));
  checkCounts(checks, path, static_cast<std::size_t>(message.positions_size() / 3),
              static_cast<std::size_t>(message.triangles_size() / 3));
  Surface surface;
  if (checks.failed()) return surface;
  for (int i = 0; i < message.positions_size(); i += 3)
    surface.vertices.emplace_back(message.positions(i), message.positions(i + 1), message.positions(i + 2));
  for (int i = 0; i < message.triangles_size(); i += 3)
    surface.triangles.push_back({message.triangles(i), message.triangles(i + 1), message.triangles(i + 2)});
  return surface;
}

// Divides faces with more than three corners into a fan.
Surface ofFile(Checks& checks, const Path& path, const v1::ColliderMesh& message,
               const MeshReader& readMesh) {
  const std::string shown = '"' + message.file() + '"';
  if (message.positions_size() > 0 || message.triangles_size() > 0)
    checks.fail(path / "file", shown, "is given together with positions or triangles; give one or the other");
  if (!readMesh)
    checks.fail(path / "file", shown,
                "files can only be named in scene files; send positions and triangles instead");
  Surface surface;
  if (checks.failed()) return surface;
  const meshes::JointRequest joints{.animation = message.animation(),
                                    .joints = limits::kMaxJoints,
                                    .keys = limits::kMaxMotionKeys,
                                    .poses = limits::kMaxAnimationPoses};
  auto source = readMesh(message.file(), message.has_skin() ? nullptr : &joints);
  if (!source) {
    checks.fail(path / "file", shown, source.error());
    return surface;
  }
  std::size_t triangles = 0;
  for (const meshes::SourceFace& face : source->faces)
    triangles += face.cornerCount < 3 ? 0 : face.cornerCount - 2;
  checkCounts(checks, path, source->vertices.size(), triangles);
  if (checks.failed()) return surface;
  surface.vertices = std::move(source->vertices);
  surface.skin = std::move(source->skin);
  for (const meshes::SourceFace& face : source->faces)
    for (std::uint32_t corner = 2; corner < face.cornerCount; ++corner)
      surface.triangles.push_back({source->cornerOf(face, 0).vertex,
                                   source->cornerOf(face, corner - 1).vertex,
                                   source->cornerOf(face, corner).vertex});
  return surface;
}

// Scales the vertices and checks that they are in the world.
void place(Checks& checks, const Path& path, float scale, std::vector<model::Vec3>& vertices) {
  for (std::size_t i = 0; i < vertices.size() && !checks.failed(); ++i) {
    vertices[i] *= scale;
    for (int axis = 0; axis < 3; ++axis)
      checks.number(path.at("positions", static_cast<int>(3 * i) + axis), vertices[i][axis],
                    limits::kPosition);
  }
}

// Gives the skin of a file the names, the scale and the vertices of the mesh, and checks that the joints are
// in the world.
std::optional<model::Skin> ofFile(Checks& checks, const Path& path, const std::string& file, float scale,
                                  model::Skin skin, std::span<const std::uint32_t> sources) {
  const auto most = static_cast<float>(limits::kPosition.max);
  const auto place = [&](model::Pose& pose, std::size_t joint, const auto& when) {
    pose.position *= scale;
    const float far = pose.position.cwiseAbs().maxCoeff();
    if (!(far <= most))
      checks.failNamed(path, file,
                       fmt::format("has the joint \"{}\" {:g} m from its parent, along one axis, {}; must be "
                                   "within {:g} m: move it, or set \"scale\"",
                                   excerpt(skin.joints[joint].name), far, when(), most));
  };
  for (std::size_t i = 0; i < skin.joints.size(); ++i) {
    const std::string& name = skin.joints[i].name;
    if (name.size() > limits::kMaxTextBytes || !isUtf8(name) || hasControlCharacters(name))
      checks.failNamed(
          path, file,
          fmt::format("has the joint {} with the name \"{}\"; must be one line of at most {} bytes "
                      "of UTF-8 without control characters",
                      i, excerpt(name), limits::kMaxTextBytes));
    place(skin.joints[i].rest, i, [] { return std::string("where the skin binds it"); });
  }
  // The times of keys increase.
  if (!skin.keys.empty() && !(skin.keys.back().time <= static_cast<float>(limits::kMotionTime.max)))
    checks.failNamed(path, file,
                     fmt::format("has an animation of {:g} s; must be at most {:g} s: export a shorter one",
                                 skin.keys.back().time, limits::kMotionTime.max));
  for (model::JointKey& key : skin.keys) {
    for (std::size_t i = 0; i < key.joints.size(); ++i)
      place(key.joints[i], i, [&] { return fmt::format("{:g} s after the animation begins", key.time); });
  }
  std::vector<model::VertexJoints> vertices;
  for (const std::uint32_t source : sources) vertices.push_back(skin.vertices[source]);
  skin.vertices = std::move(vertices);
  if (checks.failed()) return std::nullopt;
  return skin;
}

float toDistanceCell(Checks& checks, const Path& path, float value, const model::ClosedMesh& mesh) {
  const float cell = checks.number(path, value, limits::kDistanceCell);
  if (checks.failed()) return 0;
  const std::string shown = fmt::format("{}", cell);
  if (mesh.skin) checks.fail(path, shown, "is for rigid meshes; remove it, or the joints");
  const float most = model::thinnestSide(mesh) / 4;
  if (cell > most)
    checks.fail(
        path, shown,
        fmt::format("is too coarse for this mesh; use at most {:.3g}, a quarter of its thinnest side", most));
  const std::uint64_t points = model::distanceGridOf(mesh, cell).points();
  if (points > model::kMaxDistancePoints)
    checks.fail(path, shown,
                fmt::format("needs {} points; must need at most {}, so use a larger one", points,
                            model::kMaxDistancePoints));
  return cell;
}

template <typename Element>
std::string littleEndian(const std::vector<Element>& elements) {
  static_assert(std::endian::native == std::endian::little && sizeof(Element) == 12);
  return {reinterpret_cast<const char*>(elements.data()), elements.size() * sizeof(Element)};
}

}  // namespace

model::Solid toSolid(Checks& checks, const Path& path, const v1::ColliderMesh& message,
                     const MeshReader& readMesh) {
  if (message.has_animation() && (message.file().empty() || message.has_skin()))
    checks.fail(path / "animation", '"' + message.animation() + '"',
                "is an animation of a file; give it together with \"file\", and without \"skin\"");
  const float scale =
      message.has_scale() ? checks.number(path / "scale", message.scale(), limits::kScale) : 1.0f;
  Surface surface =
      message.file().empty() ? ofMessage(checks, path, message) : ofFile(checks, path, message, readMesh);
  if (!checks.failed()) place(checks, path, scale, surface.vertices);
  if (checks.failed()) return nullptr;
  const std::size_t vertexCount = surface.vertices.size();
  auto made = model::makeClosedMesh(std::move(surface.vertices), std::move(surface.triangles));
  if (const auto* problem = std::get_if<model::ClosedMeshProblem>(&made)) {
    if (problem->triangle)
      checks.fail(path, "", fmt::format("triangle {} {}", *problem->triangle, problem->text));
    else
      checks.fail(path, "", problem->text);
    return nullptr;
  }
  auto& mesh = std::get<model::ClosedMesh>(made);
  if (message.has_skin())
    mesh.skin = toSkin(checks, path / "skin", message.skin(), vertexCount, mesh.sources);
  else if (surface.skin)
    mesh.skin = ofFile(checks, path / "file", message.file(), scale, std::move(*surface.skin), mesh.sources);
  if (message.has_distance_cell())
    mesh.distanceCell = toDistanceCell(checks, path / "distanceCell", message.distance_cell(), mesh);
  if (checks.failed()) return nullptr;
  return std::make_shared<const model::ClosedMesh>(std::move(mesh));
}

void write(const model::ClosedMesh& mesh, v1::ColliderMesh& message) {
  message.Clear();
  for (const model::Vec3& p : mesh.vertices) message.mutable_positions()->Add(p.data(), p.data() + 3);
  for (const model::TriangleCorners& t : mesh.triangles) message.mutable_triangles()->Add(t.begin(), t.end());
  if (mesh.skin) write(*mesh.skin, *message.mutable_skin());
  if (mesh.distanceCell > 0) message.set_distance_cell(mesh.distanceCell);
}

void write(const model::ClosedMesh& mesh, v1::ColliderMeshDescription& message) {
  message.set_positions(littleEndian(mesh.vertices));
  message.set_triangles(littleEndian(mesh.triangles));
  if (!mesh.skin) return;
  for (const model::VertexJoints& vertex : mesh.skin->vertices) {
    message.mutable_joints()->append(reinterpret_cast<const char*>(vertex.joints.data()),
                                     vertex.joints.size());
    message.mutable_weights()->append(reinterpret_cast<const char*>(vertex.weights.data()),
                                      sizeof vertex.weights);
  }
  writeJoints(*mesh.skin, model::restJoints(*mesh.skin), *message.mutable_rest());
  for (const model::Joint& joint : mesh.skin->joints) {
    message.add_joint_names(joint.name);
    message.add_joint_parents(joint.parent ? *joint.parent + 1 : 0);
  }
}

std::size_t geometryBytes(const model::ClosedMesh& mesh) {
  return 12 * (mesh.vertices.size() + mesh.triangles.size()) + (mesh.skin ? 20 * mesh.vertices.size() : 0);
}

}  // namespace clothstream::messages
