// SPDX-License-Identifier: MIT
#include "server/scene/shared_surfaces.h"

#include <algorithm>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/messages/vectors.h"

namespace clothstream::scene {
namespace {

std::uint32_t surfacePartsFor(std::size_t elements) {
  return static_cast<std::uint32_t>((elements + kSurfacePartElements - 1) / kSurfacePartElements);
}

}  // namespace

delivery::SharedBytes surfaceList(const RoomSurfaces& surfaces, std::uint64_t& version) {
  const bool isFirst = version == 0;
  std::vector<RoomSurface> all;
  if (!surfaces.take(version, all) || (isFirst && all.empty())) return nullptr;
  v1::ServerMessage message;
  v1::RoomSurfaces& list = *message.mutable_room_surfaces();
  for (const RoomSurface& surface : all) {
    const model::Surface& mesh = surface.placed.table->surface;
    v1::RoomSurface& entry = *list.add_surfaces();
    entry.set_participant_id(surface.participant);
    entry.set_id(surface.id);
    entry.set_revision(surface.revision);
    messages::write(surface.placed.pose, *entry.mutable_pose());
    entry.set_two_sided(surface.placed.twoSided);
    entry.set_vertex_count(static_cast<std::uint32_t>(mesh.vertices.size()));
    entry.set_triangle_count(static_cast<std::uint32_t>(mesh.triangles.size()));
    entry.set_part_count(surfacePartsFor(mesh.vertices.size()) + surfacePartsFor(mesh.triangles.size()));
  }
  return delivery::serialise(message);
}

messages::Result<v1::GetSurfacePartResponse> surfacePart(const RoomSurfaces& surfaces,
                                                         const v1::GetSurfacePartRequest& request) {
  const std::optional<RoomSurface> found =
      surfaces.find(request.participant_id(), request.id(), request.revision());
  if (!found)
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_NOT_FOUND,
        fmt::format("getSurfacePart: participant {} has no surface {} with the revision {}; take those of "
                    "the newest RoomSurfaces",
                    request.participant_id(), request.id(), request.revision())});
  const model::Surface& mesh = found->placed.table->surface;
  const std::uint32_t ofVertices = surfacePartsFor(mesh.vertices.size());
  const std::uint32_t count = ofVertices + surfacePartsFor(mesh.triangles.size());
  if (request.index() >= count)
    return tl::unexpected(
        messages::FieldError{v1::ERROR_CODE_INVALID_ARGUMENT,
                             fmt::format("getSurfacePart.index = {}: must be 0 to {}, since the mesh has {} "
                                         "parts",
                                         request.index(), count - 1, count)});
  v1::GetSurfacePartResponse response;
  v1::SurfacePart& part = *response.mutable_part();
  part.set_index(request.index());
  part.set_count(count);
  part.set_two_sided(request.index() == 0 && found->placed.twoSided);
  const bool hasVertices = request.index() < ofVertices;
  const std::size_t first = kSurfacePartElements * (request.index() - (hasVertices ? 0 : ofVertices));
  const std::size_t last =
      std::min(first + kSurfacePartElements, hasVertices ? mesh.vertices.size() : mesh.triangles.size());
  for (std::size_t i = first; i < last; ++i) {
    if (hasVertices)
      for (const float number : {mesh.vertices[i].x(), mesh.vertices[i].y(), mesh.vertices[i].z()})
        part.add_positions(number);
    else
      for (const std::uint32_t corner : mesh.triangles[i]) part.add_triangles(corner);
  }
  return response;
}

}  // namespace clothstream::scene
