// SPDX-License-Identifier: MIT
// Reads a collider of a description or a frame.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/wire/skin.h"
#include "clients/core/wire/wire.h"

namespace clothstream::client {

struct Collider {
  std::string name;
  Vec3 position{};
  std::array<float, 4> orientation{0, 0, 0, 1};  // x y z w
  cs_shape shape = CS_SHAPE_HULL;
  float radius = 0, length = 0, topRadius = 0;
  Vec3 size{};
  // Serialised ConvexHull or ColliderMeshDescription, which point into the message; both are empty in frames.
  Bytes hull, mesh;
  std::vector<float> joints;  // of a mesh, in the frame of the collider: skin.h
  std::uint64_t participantId = 0;
  bool yields = false;
};

// Convex hull or closed mesh in the collider's own frame.
struct Hull {
  std::vector<float> vertices;  // 3 floats each
  std::vector<std::uint32_t> triangles;
  Skin skin;  // of a mesh with joints; then `vertices` are at rest
};

// Reuses the memory of `collider`. The functions return false or nullopt if the message is not well formed, a
// number is not finite, or there are more elements than the protocol allows.
[[nodiscard]] bool readCollider(Bytes message, Collider& collider);
[[nodiscard]] std::optional<Hull> readHull(Bytes message);
[[nodiscard]] std::optional<Hull> readMesh(Bytes message);
// Reads the radii and the length of a Sphere or a Capsule. A Sphere is a Capsule without a length.
[[nodiscard]] bool readRound(Bytes message, Collider& collider);
[[nodiscard]] bool readBox(Bytes message, Vec3& size);

// Limit for the colliders of the scene and of all participants together.
inline constexpr std::size_t kMaxSceneColliders = 4096;
// Limit for the vertices, the faces, and the vertices of a face.
inline constexpr std::size_t kMaxHullParts = 128;
// Limits of a collider that is a mesh.
inline constexpr std::size_t kMaxMeshVertices = 60'000, kMaxMeshTriangles = 20'000;

}  // namespace clothstream::client
