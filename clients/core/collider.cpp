// SPDX-License-Identifier: MIT
// Field by field through a ColliderState, its shape and its hull.
#include "clients/core/collider.h"

#include <algorithm>

namespace clothstream::client {
namespace {

// Of a sphere, which has one number, and of a capsule.
bool readRound(Bytes message, Collider& collider) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field == fixed32(1)) return setFinite(collider.radius, reader);
    return field == fixed32(2) ? setFinite(collider.length, reader) : skip(reader);
  });
}

bool readBox(Bytes message, Vec3& size) {
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    return field == bytes(1) ? readVec3(reader.get_view(), size) : skip(reader);
  });
}

// Appends a face's triangles, a fan about its first corner.
bool readFace(Bytes message, std::vector<std::uint32_t>& triangles) {
  std::vector<std::uint32_t> corners;
  const bool read = readFields(message, [&](std::uint32_t field, Reader& reader) {
    if (field == bytes(1)) return readPackedVarints(reader.get_view(), kMaxHullParts, corners);
    if (field != varint(1)) return skip(reader);
    corners.push_back(reader.get_uint32());
    return corners.size() <= kMaxHullParts;
  });
  for (std::size_t i = 2; i < corners.size(); ++i)
    triangles.insert(triangles.end(), {corners[0], corners[i - 1], corners[i]});
  return read;
}

}  // namespace

bool readCollider(Bytes message, Collider& collider) {
  collider.name.clear();
  collider.position = {};
  collider.orientation = {0, 0, 0, 1};
  collider.shape = CS_SHAPE_HULL;
  collider.radius = collider.length = 0;
  collider.size = {};
  collider.hull = {};
  collider.participantId = 0;
  return readFields(message, [&](std::uint32_t field, Reader& reader) {
    switch (field) {
      case bytes(1):
        return setText(collider.name, reader);
      case bytes(2):
        return readVec3(reader.get_view(), collider.position);
      case bytes(3): {
        if (!readFloats(reader.get_view(), collider.orientation)) return false;
        // All zero means no rotation (scene.proto).
        if (collider.orientation == std::array<float, 4>{}) collider.orientation[3] = 1;
        return true;
      }
      case varint(4):
        return set(collider.participantId, reader.get_uint64());
      case bytes(5):
        return set(collider.shape, CS_SHAPE_SPHERE) && readRound(reader.get_view(), collider);
      case bytes(6):
        return set(collider.shape, CS_SHAPE_CAPSULE) && readRound(reader.get_view(), collider);
      case bytes(7):
        reader.skip();
        return set(collider.shape, CS_SHAPE_PLANE);
      case bytes(8):
        return set(collider.shape, CS_SHAPE_BOX) && readBox(reader.get_view(), collider.size);
      case bytes(9):
        return set(collider.shape, CS_SHAPE_HULL) && set(collider.hull, reader.get_view());
      default:
        return skip(reader);
    }
  });
}

std::optional<Hull> readHull(Bytes message) {
  std::size_t faces = 0;
  std::optional<Hull> hull = readMessage<Hull>(message, [&](Hull& out, std::uint32_t field, Reader& reader) {
    if (field == bytes(2)) return ++faces <= kMaxHullParts && readFace(reader.get_view(), out.triangles);
    if (field != bytes(1)) return skip(reader);
    Vec3 vertex{};
    if (!readVec3(reader.get_view(), vertex)) return false;
    out.vertices.insert(out.vertices.end(), vertex.begin(), vertex.end());
    return out.vertices.size() <= 3 * kMaxHullParts;
  });
  if (hull && std::any_of(hull->triangles.begin(), hull->triangles.end(),
                          [&](std::uint32_t corner) { return corner >= hull->vertices.size() / 3; }))
    hull.reset();
  return hull;
}

}  // namespace clothstream::client
