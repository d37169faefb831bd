// SPDX-License-Identifier: MIT
// The mesh of a surface of the real room that a peer sends in parts.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "server/hosting/surface_maker.h"
#include "server/hosting/upload_budget.h"
#include "server/messages/field_error.h"
#include "server/messages/surface_message.h"

namespace clothstream::session {

// One mesh of one peer at a time. Not thread-safe.
class SurfaceUpload {
 public:
  // `address` is the key of the peer's address, for its share of the budget; empty for none.
  SurfaceUpload(hosting::UploadBudget& budget, std::string address)
      : budget_(budget), address_(std::move(address)) {}

  // `surfaces` are always those of the scene in which the peer is. A mesh that is dropped is cancelled there.
  //
  // Part 0 of a mesh begins. What another mesh has sent is dropped.
  void begin(scene::RoomSurfaces& surfaces, const scene::RoomSurfaces::Ticket& ticket,
             const messages::SurfacePart& part);
  // Adds a part. Returns the mesh with the last one. An error drops the mesh.
  [[nodiscard]] messages::Result<std::optional<hosting::CompleteSurface>> add(
      scene::RoomSurfaces& surfaces, std::uint32_t id, const messages::SurfacePart& part,
      const v1::SurfacePart& message);
  // Drops a mesh that is not complete, if it is of this surface.
  void drop(scene::RoomSurfaces& surfaces, std::uint32_t id);
  // Drops a mesh that is not complete, unless it is of one of these surfaces, in ascending order.
  void dropOthers(scene::RoomSurfaces& surfaces, std::span<const std::uint32_t> ids);

 private:
  hosting::UploadBudget& budget_;
  const std::string address_;
  std::optional<hosting::CompleteSurface> begun_;
  std::uint32_t next_ = 0, count_ = 0;  // parts
};

}  // namespace clothstream::session
