// SPDX-License-Identifier: MIT
#include "clients/core/wire/room_surface.h"

#include <cmath>
#include <cstring>
#include <utility>

#include <protozero/pbf_writer.hpp>

namespace clothstream::client {
namespace {

bool readSurfacePose(Bytes message, RoomSurfaceEntry& entry) {
  using F = field::Pose;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kPosition.tag:
        return readFloats(reader.get_view(), entry.position);
      case F::kOrientation.tag:
        return readFloats(reader.get_view(), entry.orientation);
      default:
        return skip(reader);
    }
  });
}

bool readEntry(Bytes message, RoomSurfaceEntry& entry) {
  using F = field::RoomSurface;
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    switch (tag) {
      case F::kParticipantId.tag:
        return set(entry.participant, reader.get_uint64());
      case F::kId.tag:
        return set(entry.id, reader.get_uint32());
      case F::kRevision.tag:
        return set(entry.revision, reader.get_uint64());
      case F::kPose.tag:
        return readSurfacePose(reader.get_view(), entry);
      case F::kTwoSided.tag:
        return set(entry.twoSided, reader.get_bool());
      case F::kVertexCount.tag:
        return set(entry.vertices, reader.get_uint32());
      case F::kTriangleCount.tag:
        return set(entry.triangles, reader.get_uint32());
      case F::kPartCount.tag:
        return set(entry.parts, reader.get_uint32());
      default:
        return skip(reader);
    }
  });
}

// Appends the floats of a packed field. Returns false if one is not finite or incomplete, or if there would
// be more than `max`.
bool readPackedFloats(Bytes packed, std::size_t max, std::vector<float>& out) {
  if (packed.size() % sizeof(float) != 0 || out.size() + packed.size() / sizeof(float) > max) return false;
  for (std::size_t at = 0; at < packed.size(); at += sizeof(float)) {
    // Floats on the wire are little-endian, as those of all devices of this client.
    float value;
    std::memcpy(&value, packed.data() + at, sizeof value);
    if (!std::isfinite(value)) return false;
    out.push_back(value);
  }
  return true;
}

}  // namespace

std::optional<std::vector<RoomSurfaceEntry>> readRoomSurfaces(Bytes message) {
  std::size_t vertices = 0, triangles = 0;
  return readMessage<std::vector<RoomSurfaceEntry>>(message, [&](std::vector<RoomSurfaceEntry>& entries,
                                                                 std::uint32_t tag, Reader& reader) {
    if (tag != field::RoomSurfaces::kSurfaces.tag) return skip(reader);
    RoomSurfaceEntry entry;
    if (!readEntry(reader.get_view(), entry)) return false;
    const bool fits = entries.size() < kMaxRoomSurfaces && entry.vertices <= kMaxRoomVertices - vertices &&
                      entry.triangles <= kMaxRoomTriangles - triangles;
    if (!fits) return true;
    vertices += entry.vertices;
    triangles += entry.triangles;
    entries.push_back(entry);
    return true;
  });
}

bool appendSurfacePart(Bytes message, const RoomSurfaceEntry& entry, RoomMesh& mesh) {
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    if (tag != field::GetSurfacePartResponse::kPart.tag) return skip(reader);
    return readFields(reader.get_view(), [&](std::uint32_t partTag, Reader& part) {
      switch (partTag) {
        case field::SurfacePart::kPositions.tag:
          return readPackedFloats(part.get_view(), std::size_t{3} * entry.vertices, mesh.positions);
        case field::SurfacePart::kTriangles.tag:
          return readPackedVarints(part.get_view(), std::size_t{3} * entry.triangles, mesh.triangles);
        default:
          return skip(part);
      }
    });
  });
}

void writeSurfacePartRequest(std::string& out, std::uint64_t requestId, const RoomSurfaceEntry& entry,
                             std::uint32_t index) {
  using F = field::GetSurfacePartRequest;
  out.clear();
  protozero::pbf_writer message(out);
  message.add_uint64(field::ClientMessage::kRequestId.number, requestId);
  protozero::pbf_writer request(message, field::ClientMessage::kGetSurfacePart.number);
  request.add_uint64(F::kParticipantId.number, entry.participant);
  request.add_uint32(F::kId.number, entry.id);
  request.add_uint64(F::kRevision.number, entry.revision);
  request.add_uint32(F::kIndex.number, index);
}

}  // namespace clothstream::client
