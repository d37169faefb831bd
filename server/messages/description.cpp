// SPDX-License-Identifier: MIT
// Stream descriptions, collider states, chunks.
#include "server/messages/description.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <string>

#include "server/messages/limits.h"
#include "server/messages/scene_message.h"
#include "server/messages/vectors.h"

namespace clothstream::messages {
namespace {

std::string littleEndian(const std::vector<scene::Vec3>& positions) {
  static_assert(std::endian::native == std::endian::little && sizeof(scene::Vec3) == 12);
  return {reinterpret_cast<const char*>(positions.data()), positions.size() * sizeof(scene::Vec3)};
}

}  // namespace

void write(const scene::SphereCollider& collider, const scene::Vec3& position, v1::ColliderState& state) {
  state.set_name(collider.name);
  write(position, *state.mutable_position());
  write(collider.pose.orientation, *state.mutable_orientation());
  state.set_participant_id(0);
  state.mutable_sphere()->set_radius(collider.radius);
}

void write(const scene::ParticipantCollider& collider, std::uint64_t participantId,
           v1::ColliderState& state) {
  state.set_name(std::to_string(collider.id));
  write(collider.pose.position, *state.mutable_position());
  write(collider.pose.orientation, *state.mutable_orientation());
  state.set_participant_id(participantId);
  state.mutable_sphere()->set_radius(collider.radius);
}

v1::StreamDescription toDescription(const scene::Scene& scene, std::uint32_t epoch, std::uint32_t codec) {
  v1::StreamDescription description;
  description.set_epoch(epoch);
  description.set_codec(codec);
  description.set_scene(scene.name);
  description.set_simulation_rate(scene.simulationRate);
  description.set_stream_rate(scene.streamRate);
  description.set_max_error(scene.stream.maxError);
  description.set_normals(toMessage(scene.stream.normals));
  for (const scene::Cloth& cloth : scene.cloths) {
    v1::ClothDescription& message = *description.add_cloths();
    message.set_name(cloth.name);
    message.set_vertex_count(cloth.grid.nodeCount());
    message.set_rows(cloth.grid.rows);
    message.set_columns(cloth.grid.columns);
    message.set_rest_positions(littleEndian(scene::restPositions(cloth.grid)));
  }
  *description.mutable_definition() = toMessage(scene);
  return description;
}

v1::SceneSummary toSummary(const scene::Scene& scene) {
  v1::SceneSummary summary;
  summary.set_name(scene.name);
  summary.set_description(scene.description);
  summary.set_vertex_count(scene.nodeCount());
  summary.set_cloth_count(static_cast<std::uint32_t>(scene.cloths.size()));
  return summary;
}

std::vector<v1::Chunk> toChunks(std::uint64_t contentId, v1::ContentKind kind, std::string_view content) {
  assert(content.size() <= limits::kMaxContentBytes);
  const std::size_t count =
      std::max<std::size_t>(1, (content.size() + limits::kMaxChunkBytes - 1) / limits::kMaxChunkBytes);
  std::vector<v1::Chunk> chunks(count);
  for (std::size_t i = 0; i < count; ++i) {
    chunks[i].set_content_id(contentId);
    chunks[i].set_kind(kind);
    chunks[i].set_index(static_cast<std::uint32_t>(i));
    chunks[i].set_count(static_cast<std::uint32_t>(count));
    chunks[i].set_total_bytes(content.size());
    const std::string_view piece = content.substr(i * limits::kMaxChunkBytes, limits::kMaxChunkBytes);
    chunks[i].set_data(piece.data(), piece.size());
  }
  return chunks;
}

}  // namespace clothstream::messages
