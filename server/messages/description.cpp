// SPDX-License-Identifier: MIT
// Writes stream descriptions, collider states and chunks.
#include "server/messages/description.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <string>

#include "server/messages/limits.h"
#include "server/messages/scene_message.h"
#include "server/messages/shapes.h"
#include "server/messages/solid_message.h"
#include "server/messages/vectors.h"
#include "server/model/gas.h"
#include "server/model/material.h"
#include "server/model/mesh.h"
#include "server/model/origin.h"

namespace clothstream::messages {
namespace {

static_assert(sizeof(model::Vec3) == 12 && sizeof(model::Uv) == 8 && sizeof(model::Triangle) == 12);

// Bytes of contiguous elements that consist of floats or integers.
template <typename Element>
std::string littleEndian(const std::vector<Element>& elements) {
  static_assert(std::endian::native == std::endian::little);
  return {reinterpret_cast<const char*>(elements.data()), elements.size() * sizeof(Element)};
}

void writeShape(const model::Cloth& cloth, v1::ClothDescription& message) {
  message.set_vertex_count(cloth.nodeCount());
  message.set_rest_positions(littleEndian(model::restPositions(cloth)));
  if (!cloth.mesh) {
    message.set_rows(cloth.grid.rows);
    message.set_columns(cloth.grid.columns);
    return;
  }
  const model::MeshShape& shape = cloth.mesh->shape;
  message.set_triangles(littleEndian(shape.triangles));
  message.set_uvs(littleEndian(shape.uvs));
  message.set_uv_triangles(littleEndian(shape.uvTriangles));
  for (const model::Submesh& part : shape.submeshes) {
    v1::Submesh& partMessage = *message.add_submeshes();
    partMessage.set_name(part.name);
    partMessage.set_triangle_count(part.triangleCount);
  }
}

}  // namespace

void write(const model::Collider& collider, const model::Pose& pose, v1::ColliderState& state) {
  state.set_name(collider.name);
  write(pose.position, *state.mutable_position());
  write(pose.orientation, *state.mutable_orientation());
  state.set_participant_id(0);
  write(collider.shape, state);
}

void write(const model::ParticipantCollider& collider, std::uint64_t participantId,
           v1::ColliderState& state) {
  state.set_name(std::to_string(collider.id));
  write(collider.pose.position, *state.mutable_position());
  write(collider.pose.orientation, *state.mutable_orientation());
  state.set_participant_id(participantId);
  write(collider.shape, state);
}

std::size_t geometryBytes(const model::Cloth& cloth) {
  std::size_t bytes = sizeof(model::Vec3) * cloth.nodeCount();
  if (!cloth.mesh) return bytes;
  const model::MeshShape& shape = cloth.mesh->shape;
  return bytes + sizeof(model::Triangle) * (shape.triangles.size() + shape.uvTriangles.size()) +
         sizeof(model::Uv) * shape.uvs.size();
}

v1::StreamDescription toDescription(const model::Scene& scene, std::uint32_t epoch, std::uint32_t codec,
                                    double seconds) {
  v1::StreamDescription description = descriptionWithoutCloths(scene, epoch, codec, seconds);
  description.mutable_cloths()->Swap(clothsOfDescription(scene).mutable_cloths());
  return description;
}

v1::StreamDescription clothsOfDescription(const model::Scene& scene) {
  v1::StreamDescription description;
  for (const model::Cloth& cloth : scene.cloths) {
    v1::ClothDescription& message = *description.add_cloths();
    message.set_name(cloth.name);
    writeShape(cloth, message);
  }
  return description;
}

v1::StreamDescription descriptionWithoutCloths(const model::Scene& scene, std::uint32_t epoch,
                                               std::uint32_t codec, double seconds) {
  v1::StreamDescription description;
  description.set_epoch(epoch);
  description.set_codec(codec);
  description.set_scene(scene.name);
  description.set_simulation_rate(scene.simulationRate);
  description.set_stream_rate(scene.streamRate);
  description.set_max_error(scene.stream.maxError);
  description.set_normals(toMessage(scene.stream.normals));
  description.set_qualities(scene.stream.qualities);
  if (const model::Vec3 origin = model::originOf(scene); !origin.isZero(0))
    write(origin, *description.mutable_origin());
  for (const model::Collider& collider : scene.colliders) {
    v1::ColliderState& state = *description.add_colliders();
    write(collider, model::poseAt(collider, seconds), state);
    if (const auto* hull = std::get_if<model::Hull>(&collider.shape))
      writeHull(**hull, *state.mutable_hull());
    if (const auto* solid = std::get_if<model::Solid>(&collider.shape)) write(**solid, *state.mutable_mesh());
  }
  *description.mutable_definition() = toMessageWithoutMeshes(scene);
  // A cloth that cannot hold gas has no pressure, so that clients do not offer it.
  for (std::size_t i = 0; i < scene.cloths.size(); ++i)
    if (scene.integrator != model::Integrator::semiImplicitEuler || !model::canHoldGas(scene.cloths[i]))
      description.mutable_definition()->mutable_cloths(static_cast<int>(i))->clear_pressure();
  for (const model::Material& material : model::materials())
    description.add_materials(std::string(material.name));
  return description;
}

v1::SceneSummary toSummary(const model::Scene& scene) {
  v1::SceneSummary summary;
  summary.set_name(scene.name);
  summary.set_description(scene.description);
  summary.set_vertex_count(scene.nodeCount());
  summary.set_cloth_count(static_cast<std::uint32_t>(scene.cloths.size()));
  return summary;
}

std::size_t chunkCount(std::size_t contentBytes) {
  return std::max<std::size_t>(1, (contentBytes + limits::kMaxChunkBytes - 1) / limits::kMaxChunkBytes);
}

v1::Chunk toChunk(std::uint64_t contentId, v1::ContentKind kind, std::span<const std::string_view> parts,
                  std::size_t index) {
  std::size_t total = 0;
  for (const std::string_view part : parts) total += part.size();
  assert(total <= limits::kMaxContentBytes && index < chunkCount(total));
  const std::size_t begin = index * limits::kMaxChunkBytes;
  const std::size_t end = std::min(begin + limits::kMaxChunkBytes, total);
  v1::Chunk chunk;
  chunk.set_content_id(contentId);
  chunk.set_kind(kind);
  chunk.set_index(static_cast<std::uint32_t>(index));
  chunk.set_count(static_cast<std::uint32_t>(chunkCount(total)));
  chunk.set_total_bytes(total);
  chunk.mutable_data()->reserve(end - begin);
  std::size_t start = 0;  // offset of the part in the content
  for (const std::string_view part : parts) {
    const std::size_t from = std::max(begin, start), to = std::min(end, start + part.size());
    if (from < to) chunk.mutable_data()->append(part.substr(from - start, to - from));
    start += part.size();
  }
  return chunk;
}

}  // namespace clothstream::messages
