// SPDX-License-Identifier: MIT
// What a client says (proto/clothstream/v1/session.proto), serialised. Each function replaces what `out`
// holds and reuses its memory.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "clients/core/core.h"
#include "clients/core/server_message.h"

namespace clothstream::client {

struct ColliderChange {
  std::string_view name;
  const Vec3* position = nullptr;
  const float* radius = nullptr;
};

void writeHello(std::string& out, std::uint64_t requestId, std::string_view scene,
                std::string_view clientName);
// Ids of the colliders are their places in the span.
void writeColliderPoses(std::string& out, std::span<const cs_own_collider> colliders,
                        std::uint64_t clientTimeUs);
void writeParameterChange(std::string& out, std::uint64_t requestId, const ParameterChange& change);
void writeColliderChange(std::string& out, std::uint64_t requestId, const ColliderChange& change);
void writePing(std::string& out, std::uint64_t requestId, std::uint64_t clientTimeUs);
void writeFrameAck(std::string& out, std::uint64_t tick);
void writeKeyFrameRequest(std::string& out, std::uint32_t epoch);
void writeListScenes(std::string& out, std::uint64_t requestId);

}  // namespace clothstream::client
