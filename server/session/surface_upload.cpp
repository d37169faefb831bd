// SPDX-License-Identifier: MIT
#include "server/session/surface_upload.h"

#include <algorithm>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::session {

void SurfaceUpload::begin(scene::RoomSurfaces& surfaces, const scene::RoomSurfaces::Ticket& ticket,
                          const messages::SurfacePart& part) {
  if (begun_) surfaces.cancel(begun_->ticket);
  begun_.emplace(hosting::CompleteSurface{.parts = {},
                                          .ticket = ticket,
                                          .twoSided = part.twoSided,
                                          .friction = part.friction,
                                          .reservation = hosting::UploadReservation(budget_, address_)});
  next_ = 0;
  count_ = part.count;
}

messages::Result<std::optional<hosting::CompleteSurface>> SurfaceUpload::add(
    scene::RoomSurfaces& surfaces, std::uint32_t id, const messages::SurfacePart& part,
    const v1::SurfacePart& message) {
  const auto refuse = [&](messages::FieldError error) {
    if (begun_) surfaces.cancel(begun_->ticket);
    begun_.reset();
    return tl::unexpected(std::move(error));
  };
  if (!begun_ || begun_->ticket.id != id || part.index != next_ || part.count != count_) {
    std::string expected =
        begun_ ? fmt::format(", or part {} of {} of surface {}", next_, count_, begun_->ticket.id) : "";
    return refuse(
        {v1::ERROR_CODE_INVALID_ARGUMENT,
         fmt::format("surface.part.index = {} of {}, surface {}: must be 0{}; send the mesh from its "
                     "first part on",
                     part.index, part.count, id, expected)});
  }
  const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(message.positions_size()) +
                            sizeof(std::uint32_t) * static_cast<std::size_t>(message.triangles_size());
  if (!begun_->reservation.grow(bytes))
    return refuse(
        {v1::ERROR_CODE_RESOURCE_EXHAUSTED,
         "surface: the server has no memory left for uploads (--max-upload-memory), or none for this "
         "address (--profile); try again later",
         telemetry::Refusal::uploads});
  if (auto added = messages::appendTo(begun_->parts, message); !added)
    return refuse(std::move(added.error()));
  if (++next_ < count_) return std::nullopt;
  return std::exchange(begun_, std::nullopt);
}

void SurfaceUpload::drop(scene::RoomSurfaces& surfaces, std::uint32_t id) {
  if (!begun_ || begun_->ticket.id != id) return;
  surfaces.cancel(begun_->ticket);
  begun_.reset();
}

void SurfaceUpload::dropOthers(scene::RoomSurfaces& surfaces, std::span<const std::uint32_t> ids) {
  if (begun_ && !std::ranges::binary_search(ids, begun_->ticket.id)) drop(surfaces, begun_->ticket.id);
}

}  // namespace clothstream::session
