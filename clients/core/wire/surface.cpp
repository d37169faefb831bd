// SPDX-License-Identifier: MIT
#include "clients/core/wire/surface.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include <protozero/pbf_writer.hpp>

#include "clients/core/wire/field_numbers.h"

namespace clothstream::client {
namespace {

using SurfaceWriter = protozero::pbf_writer;

std::uint32_t partsFor(std::size_t numbers) {
  constexpr std::size_t kNumbers = 3 * std::size_t{kSurfacePartElements};
  return static_cast<std::uint32_t>((numbers + kNumbers - 1) / kNumbers);
}

template <std::size_t Count>
void addNumbers(SurfaceWriter& parent, std::uint32_t number, const std::array<float, Count>& numbers) {
  SurfaceWriter message(parent, number);
  for (std::size_t i = 0; i < Count; ++i) message.add_float(static_cast<std::uint32_t>(i + 1), numbers[i]);
}

void addSurfacePose(SurfaceWriter& message, const OwnSurface& surface) {
  SurfaceWriter pose(message, field::SurfaceUpdate::kPose.number);
  addNumbers(pose, field::Pose::kPosition.number, surface.position);
  if (surface.orientation != std::array<float, 4>{})
    addNumbers(pose, field::Pose::kOrientation.number, surface.orientation);
}

template <typename Fill>
void writeSurface(std::string& out, std::uint32_t id, Fill fill) {
  out.clear();
  SurfaceWriter message(out);
  SurfaceWriter update(message, field::ClientMessage::kSurface.number);
  update.add_uint32(field::SurfaceUpdate::kId.number, id);
  fill(update);
}

}  // namespace

std::uint32_t surfacePartCount(const OwnSurface& surface) {
  return std::max(1u, partsFor(surface.positions.size()) + partsFor(surface.triangles.size()));
}

void writeSurfacePart(std::string& out, const OwnSurface& surface, std::uint32_t index) {
  writeSurface(out, surface.id, [&](SurfaceWriter& update) {
    if (index == 0) addSurfacePose(update, surface);
    using F = field::SurfacePart;
    SurfaceWriter part(update, field::SurfaceUpdate::kPart.number);
    part.add_uint32(F::kIndex.number, index);
    part.add_uint32(F::kCount.number, surfacePartCount(surface));
    const auto numbersOf = [](const auto& all, std::uint32_t piece) {
      const std::size_t first = std::min(all.size(), std::size_t{3} * kSurfacePartElements * piece);
      const std::size_t last = std::min(all.size(), first + std::size_t{3} * kSurfacePartElements);
      return std::pair(all.begin() + static_cast<std::ptrdiff_t>(first),
                       all.begin() + static_cast<std::ptrdiff_t>(last));
    };
    const std::uint32_t ofPositions = partsFor(surface.positions.size());
    if (index < ofPositions) {
      const auto [first, last] = numbersOf(surface.positions, index);
      part.add_packed_float(F::kPositions.number, first, last);
    } else {
      const auto [first, last] = numbersOf(surface.triangles, index - ofPositions);
      part.add_packed_uint32(F::kTriangles.number, first, last);
    }
    if (index > 0) return;
    if (surface.twoSided) part.add_bool(F::kTwoSided.number, true);
    part.add_float(F::kFriction.number, surface.friction);
  });
}

void writeSurfacePose(std::string& out, const OwnSurface& surface) {
  writeSurface(out, surface.id, [&](SurfaceWriter& update) { addSurfacePose(update, surface); });
}

void writeSurfaceRemoval(std::string& out, std::uint32_t id) {
  writeSurface(out, id,
               [](SurfaceWriter& update) { update.add_bool(field::SurfaceUpdate::kRemove.number, true); });
}

void writeKeptSurfaces(std::string& out, std::span<const OwnSurface> surfaces) {
  writeSurface(out, 0, [&](SurfaceWriter& update) {
    std::vector<std::uint32_t> ids;
    for (std::size_t i = 0; i < std::min(surfaces.size(), kMaxKeptSurfaces); ++i)
      ids.push_back(surfaces[i].id);
    // A writer of a message takes it back if nothing is in it.
    if (ids.empty()) return update.add_message(field::SurfaceUpdate::kKeep.number, std::string());
    SurfaceWriter keep(update, field::SurfaceUpdate::kKeep.number);
    keep.add_packed_uint32(field::KeptSurfaces::kIds.number, ids.begin(), ids.end());
  });
}

}  // namespace clothstream::client
