// SPDX-License-Identifier: MIT
// Converts meshes that messages contain or name.
#include "server/messages/mesh_message.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "proto/text/excerpt.h"
#include "server/messages/limits.h"
#include "server/messages/vectors.h"

namespace clothstream::messages {
namespace {

meshes::MeshLimits meshLimits(const SceneLimits& most) {
  return {.maxVertices = std::min(most.nodes, limits::kMaxNodes),
          .maxCoordinate = static_cast<float>(limits::kPosition.max),
          .minEdge = static_cast<float>(limits::kMinSpacing),
          .maxNodeSprings = most.nodeSprings,
          .cancellation = most.cancellation};
}

void checkWhole(Checks& checks, const Path& path, int size, int each) {
  if (size % each != 0)
    checks.fail(path, "", fmt::format("has {} numbers; must have {} for each element", size, each));
}

void addParts(Checks& checks, const Path& path, const v1::Mesh& message, meshes::MeshSource& source) {
  std::size_t first = 0;
  for (int i = 0; i < message.submeshes_size(); ++i) {
    const v1::Submesh& part = message.submeshes(i);
    const Path at = path.at("submeshes", i);
    source.parts.push_back({checks.text(at / "name", part.name()), first});
    if (part.triangle_count() == 0 || part.triangle_count() > source.faces.size() - first)
      checks.fail(
          at / "triangleCount", fmt::format("{}", part.triangle_count()),
          fmt::format("must be 1 or more, and there are {} triangles left", source.faces.size() - first));
    if (checks.failed()) return;
    first += part.triangle_count();
  }
  if (!source.parts.empty() && first != source.faces.size())
    checks.fail(path / "submeshes", "",
                fmt::format("have {} triangles of {}; must have all", first, source.faces.size()));
}

meshes::MeshSource toSource(Checks& checks, const Path& path, const v1::Mesh& message) {
  meshes::MeshSource source;
  checkWhole(checks, path / "positions", message.positions_size(), 3);
  checkWhole(checks, path / "triangles", message.triangles_size(), 3);
  checkWhole(checks, path / "uvs", message.uvs_size(), 2);
  const bool ownUvs = message.uv_triangles_size() > 0;
  if (ownUvs && message.uv_triangles_size() != message.triangles_size())
    checks.fail(path / "uvTriangles", "",
                fmt::format("has {} numbers; must have as many as triangles, {}, or none",
                            message.uv_triangles_size(), message.triangles_size()));
  if (!ownUvs && message.uvs_size() > 0 && 3 * message.uvs_size() != 2 * message.positions_size())
    checks.fail(path / "uvs", "",
                fmt::format("has {} numbers for {} vertices; without uvTriangles it must have two for each",
                            message.uvs_size(), message.positions_size() / 3));
  if (checks.failed()) return source;
  for (int i = 0; i < message.positions_size(); i += 3)
    source.vertices.emplace_back(message.positions(i), message.positions(i + 1), message.positions(i + 2));
  for (int i = 0; i < message.uvs_size(); i += 2) source.uvs.emplace_back(message.uvs(i), message.uvs(i + 1));
  for (int i = 0; i < message.triangles_size(); i += 3) {
    meshes::SourceFace& face = source.faces.emplace_back();
    for (int corner = 0; corner < 3; ++corner) {
      const auto at = static_cast<std::size_t>(corner);
      face.vertices[at] = message.triangles(i + corner);
      face.uvs[at] = ownUvs ? message.uv_triangles(i + corner) : face.vertices[at];
    }
  }
  source.halves.assign(message.quads().begin(), message.quads().end());
  addParts(checks, path, message, source);
  return source;
}

// Names of parts reach clients, so those of a file have the rules of those in a message.
void checkPartNames(Checks& checks, const Path& path, std::string_view shown,
                    const meshes::MeshSource& source) {
  for (const auto& part : source.parts) {
    Checks ofName;
    ofName.text(Path(), part.name);
    if (ofName.failed())
      checks.fail(
          path, shown,
          fmt::format("has a material or object named \"{}\", whose name must be one line of at most {} "
                      "bytes of UTF-8 without control characters: rename it",
                      excerpt(part.name), limits::kMaxTextBytes));
  }
}

// With the joints of the file if the cloth has a skin.
meshes::MeshSource readSource(Checks& checks, const Path& path, const v1::Mesh& message, bool hasSkin,
                              const MeshReader& readMesh) {
  const std::string shown = '"' + message.file() + '"';
  if (message.positions_size() > 0 || message.triangles_size() > 0) {
    checks.fail(path / "file", shown, "is given together with positions or triangles; give one or the other");
    return {};
  }
  if (!readMesh) {
    checks.fail(path / "file", shown,
                "files can only be named in scene files; send positions and triangles instead");
    return {};
  }
  const meshes::JointRequest joints{.animation = {},
                                    .joints = limits::kMaxJoints,
                                    .keys = limits::kMaxMotionKeys,
                                    .poses = limits::kMaxAnimationPoses,
                                    .animated = false,
                                    .attributes = true};
  auto source = readMesh(message.file(), hasSkin ? &joints : nullptr);
  if (source) checkPartNames(checks, path / "file", shown, *source);
  if (source) return std::move(*source);
  checks.fail(path / "file", shown, source.error());
  return {};
}

v1::MeshRepair toMessage(const std::string& cloth, const meshes::Repairs& repairs) {
  v1::MeshRepair message;
  message.set_cloth(cloth);
  message.set_triangulated_faces(repairs.triangulatedFaces);
  message.set_dropped_faces(repairs.droppedFaces);
  message.set_dropped_duplicates(repairs.droppedDuplicates);
  message.set_split_edges(repairs.splitEdges);
  message.set_split_vertices(repairs.splitVertices);
  message.set_added_vertices(repairs.addedVertices);
  message.set_turned_triangles(repairs.turnedTriangles);
  message.set_cut_edges(repairs.cutEdges);
  message.set_fitted_scale(static_cast<float>(repairs.fittedScale));
  for (std::string& sentence : repairs.sentences()) message.add_sentences(std::move(sentence));
  return message;
}

}  // namespace

ClothVertices toMeshCloth(Checks& checks, const Path& path, const v1::Cloth& message,
                          const MeshReader& readMesh, const SceneLimits& most, model::Cloth& cloth,
                          std::vector<v1::MeshRepair>& repairs) {
  const v1::Mesh& mesh = message.mesh();
  const Path at = path / "mesh";
  meshes::MeshOptions options{.pose = toPose(checks, at / "pose", mesh.pose()),
                              .scale = 1,
                              .weldDistance = limits::kDefaultWeldDistance,
                              .repair = mesh.repair(),
                              .fit = mesh.fit()};
  if (mesh.has_scale()) options.scale = checks.number(at / "scale", mesh.scale(), limits::kScale);
  if (mesh.has_weld_distance())
    options.weldDistance = checks.number(at / "weldDistance", mesh.weld_distance(), limits::kWeldDistance);
  if (checks.failed()) return {};
  meshes::MeshSource source = mesh.file().empty()
                                  ? toSource(checks, at, mesh)
                                  : readSource(checks, at, mesh, message.has_skin(), readMesh);
  if (checks.failed()) return {};
  auto built = meshes::buildMesh(source, options, meshLimits(most));
  if (!built) {
    const std::string shown = mesh.file().empty() ? "" : '"' + mesh.file() + '"';
    if (built.error().isTooLarge)
      checks.failSize(at, built.error().text, shown);
    else
      checks.fail(at, shown, built.error().text);
    return {};
  }
  if (!built->repairs.isEmpty()) repairs.push_back(toMessage(message.name(), built->repairs));
  cloth.mesh = std::make_shared<const model::Mesh>(std::move(built->mesh));
  return {.nodes = {std::move(built->nodeOfVertex), std::move(built->nextCopy)},
          .skin = std::move(source.skin),
          .attributes = std::move(source.attributes)};
}

void write(const model::Mesh& mesh, v1::Mesh& message) {
  const model::MeshShape& shape = mesh.shape;
  for (const model::Vec3& p : shape.positions) message.mutable_positions()->Add(p.data(), p.data() + 3);
  for (const model::Triangle& t : shape.triangles) message.mutable_triangles()->Add(t.begin(), t.end());
  message.mutable_quads()->Add(shape.quads.begin(), shape.quads.end());
  for (const model::Uv& uv : shape.uvs) message.mutable_uvs()->Add(uv.data(), uv.data() + 2);
  for (const model::Triangle& t : shape.uvTriangles) message.mutable_uv_triangles()->Add(t.begin(), t.end());
  for (const model::Submesh& part : shape.submeshes) {
    v1::Submesh& partMessage = *message.add_submeshes();
    partMessage.set_name(part.name);
    partMessage.set_triangle_count(part.triangleCount);
  }
  message.set_weld_distance(0);
}

}  // namespace clothstream::messages
