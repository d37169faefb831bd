// SPDX-License-Identifier: MIT
#include "server/session/surface_upload.h"

#include <algorithm>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::session {
namespace {

// A mesh that was refused keeps the place of its parts, because more of them may be on their way. They get no
// error of their own.
bool isRefused(const hosting::CompleteSurface& mesh) {
  return mesh.ticket.number == 0;
}

}  // namespace

void SurfaceUpload::begin(scene::RoomSurfaces& surfaces, const scene::RoomSurfaces::Ticket& ticket,
                          const messages::SurfacePart& part) {
  if (begun_) drop(surfaces, begun_->ticket.id);
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
  const bool continues = begun_ && begun_->ticket.id == id && part.index == next_ && part.count == count_;
  if (!continues) {
    const std::string expected =
        begun_ && !isRefused(*begun_)
            ? fmt::format(", or part {} of {} of surface {}", next_, count_, begun_->ticket.id)
            : "";
    if (begun_) drop(surfaces, begun_->ticket.id);
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("surface.part.index = {} of {}, surface {}: must be 0{}; send the mesh from its first "
                    "part on",
                    part.index, part.count, id, expected)});
  }
  const bool isLast = ++next_ == count_;
  if (isRefused(*begun_)) {
    if (isLast) begun_.reset();
    return std::nullopt;
  }
  const auto refuse = [&](messages::FieldError error) {
    surfaces.cancel(begun_->ticket);
    begun_->ticket.number = 0;
    begun_->parts = {};
    begun_->reservation.giveBack();
    if (isLast) begun_.reset();
    error.text = fmt::format("surface.id = {}: {}", id, error.text);
    return tl::unexpected(std::move(error));
  };
  const std::size_t bytes = sizeof(float) * static_cast<std::size_t>(message.positions_size()) +
                            sizeof(std::uint32_t) * static_cast<std::size_t>(message.triangles_size());
  if (!begun_->reservation.grow(bytes))
    return refuse({v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                   "the server has no memory left for uploads (--max-upload-memory), or none for this "
                   "address (--profile); try again later",
                   telemetry::Refusal::uploads});
  if (auto added = messages::appendTo(begun_->parts, message); !added)
    return refuse(std::move(added.error()));
  return isLast ? std::exchange(begun_, std::nullopt) : std::nullopt;
}

void SurfaceUpload::drop(scene::RoomSurfaces& surfaces, std::uint32_t id) {
  if (!begun_ || begun_->ticket.id != id) return;
  if (!isRefused(*begun_)) surfaces.cancel(begun_->ticket);
  begun_.reset();
}

void SurfaceUpload::dropOthers(scene::RoomSurfaces& surfaces, std::span<const std::uint32_t> ids) {
  if (begun_ && !std::ranges::binary_search(ids, begun_->ticket.id)) drop(surfaces, begun_->ticket.id);
}

}  // namespace clothstream::session
