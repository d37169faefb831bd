// SPDX-License-Identifier: MIT
// Surfaces of the real rooms as everyone in a scene gets them, where the server permits that.
#pragma once

#include <cstddef>
#include <cstdint>

#include "server/delivery/envelope.h"
#include "server/delivery/wire_types.h"
#include "server/messages/field_error.h"
#include "server/scene/room_surfaces.h"

namespace clothstream::scene {

// Vertices, or triangles, of one part of a mesh. Its message has at most 48 kB.
inline constexpr std::size_t kSurfacePartElements = 4000;

// RoomSurfaces of session.proto. Null if the surfaces have not changed since the call that set `version`. If
// it is 0, null if there are none.
delivery::SharedBytes surfaceList(const RoomSurfaces& surfaces, std::uint64_t& version);

// A part of the mesh of a surface that acts. Returns NOT_FOUND if the surface or this mesh of it is gone.
messages::Result<v1::GetSurfacePartResponse> surfacePart(const RoomSurfaces& surfaces,
                                                         const v1::GetSurfacePartRequest& request);

}  // namespace clothstream::scene
