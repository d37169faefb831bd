// SPDX-License-Identifier: MIT
// A collider, as descriptions and frames have it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/wire/wire.h"

namespace clothstream::client {

struct Collider {
  std::string name;
  Vec3 position{};
  std::array<float, 4> orientation{0, 0, 0, 1};  // x y z w
  cs_shape shape = CS_SHAPE_HULL;
  float radius = 0, length = 0;
  Vec3 size{};
  Bytes hull;  // a serialised ConvexHull, good as long as the message; frames have none
  std::uint64_t participantId = 0;
};

// Of a hull, in its own frame.
struct Hull {
  std::vector<float> vertices;  // 3 each
  std::vector<std::uint32_t> triangles;
};

// Reuses the memory of `collider`. False, or nullopt: not well formed, a number that is not finite, or more
// parts than the protocol allows.
[[nodiscard]] bool readCollider(Bytes message, Collider& collider);
[[nodiscard]] std::optional<Hull> readHull(Bytes message);

// The scene's and all participants'.
inline constexpr std::size_t kMaxSceneColliders = 4096;
inline constexpr std::size_t kMaxHullParts = 128;  // vertices, faces

}  // namespace clothstream::client
