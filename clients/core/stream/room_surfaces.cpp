// SPDX-License-Identifier: MIT
#include "clients/core/stream/room_surfaces.h"

#include <algorithm>
#include <utility>

namespace clothstream::client {
namespace {

bool isSameMesh(const RoomSurfaceEntry& a, const RoomSurfaceEntry& b) {
  return a.participant == b.participant && a.id == b.id && a.revision == b.revision;
}

bool isSameSurface(const RoomSurfaceEntry& a, const RoomSurfaceEntry& b) {
  return isSameMesh(a, b) && a.position == b.position && a.orientation == b.orientation &&
         a.twoSided == b.twoSided;
}

}  // namespace

void RoomSurfaces::follow(bool on) {
  follows_ = on;
}

void RoomSurfaces::collect() {
  complete_.clear();
  for (const Surface& surface : surfaces_)
    if (surface.isComplete()) complete_.push_back(&surface);
}

bool RoomSurfaces::listed(const std::vector<RoomSurfaceEntry>& entries, std::uint64_t ownParticipant) {
  std::vector<Surface> former = std::exchange(surfaces_, {});
  bool changes = false;
  for (const RoomSurfaceEntry& entry : entries) {
    if (entry.participant == ownParticipant) continue;
    const auto known = std::find_if(former.begin(), former.end(),
                                    [&](const Surface& surface) { return isSameMesh(surface.entry, entry); });
    if (known == former.end()) {
      surfaces_.push_back({.entry = entry, .mesh = {}, .nextPart = 0, .isBroken = entry.parts == 0});
      continue;
    }
    changes |= known->isComplete() && !isSameSurface(known->entry, entry);
    known->entry.position = entry.position;
    known->entry.orientation = entry.orientation;
    known->entry.twoSided = entry.twoSided;
    surfaces_.push_back(std::move(*known));
    former.erase(known);
  }
  changes |=
      std::any_of(former.begin(), former.end(), [](const Surface& surface) { return surface.isComplete(); });
  collect();
  return changes;
}

bool RoomSurfaces::forget() {
  const bool had = !complete_.empty();
  surfaces_.clear();
  complete_.clear();
  waitsFor_ = 0;
  left_ = kWindow;
  return had;
}

RoomSurfaces::Surface* RoomSurfaces::missing() {
  const auto found = std::find_if(surfaces_.begin(), surfaces_.end(), [](const Surface& surface) {
    return !surface.isBroken && !surface.isComplete();
  });
  return found == surfaces_.end() ? nullptr : &*found;
}

bool RoomSurfaces::answered(std::uint64_t requestId, Bytes message) {
  if (waitsFor_ == 0 || requestId != waitsFor_) return false;
  waitsFor_ = 0;
  const auto asked = std::find_if(surfaces_.begin(), surfaces_.end(),
                                  [&](const Surface& surface) { return isSameMesh(surface.entry, asked_); });
  if (asked == surfaces_.end()) return false;  // it has gone meanwhile
  const RoomSurfaceEntry& entry = asked->entry;
  RoomMesh& mesh = asked->mesh;
  asked->isBroken = !appendSurfacePart(message, entry, mesh);
  ++asked->nextPart;
  if (!asked->isComplete()) return false;
  const bool isWhole = mesh.positions.size() == std::size_t{3} * entry.vertices &&
                       mesh.triangles.size() == std::size_t{3} * entry.triangles &&
                       std::all_of(mesh.triangles.begin(), mesh.triangles.end(),
                                   [&](std::uint32_t vertex) { return vertex < entry.vertices; });
  asked->isBroken = !isWhole;
  collect();
  return isWhole;
}

bool RoomSurfaces::refused(std::uint64_t requestId, bool isTooEarly) {
  if (waitsFor_ == 0 || requestId != waitsFor_) return false;
  waitsFor_ = 0;
  for (Surface& surface : surfaces_)
    if (isSameMesh(surface.entry, asked_)) surface.isBroken = !isTooEarly;
  if (isTooEarly) left_ = 0;
  return true;
}

void RoomSurfaces::update(std::uint64_t nowUs) {
  if (left_ == kWindow || nowUs - openedUs_ < kWindowUs) return;
  openedUs_ = nowUs;
  left_ = kWindow;
}

const std::string* RoomSurfaces::next(std::uint64_t& lastId) {
  if (!follows_ || waitsFor_ != 0 || left_ == 0) return nullptr;
  const Surface* const surface = missing();
  if (surface == nullptr) return nullptr;
  --left_;
  waitsFor_ = ++lastId;
  asked_ = surface->entry;
  writeSurfacePartRequest(message_, waitsFor_, surface->entry, surface->nextPart);
  return &message_;
}

}  // namespace clothstream::client
