// SPDX-License-Identifier: MIT
#include "server/scene/room_surfaces.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/model/price.h"
#include "server/model/surface.h"

namespace clothstream::scene {
namespace {

tl::unexpected<messages::FieldError> noRoom(std::string text) {
  return tl::unexpected(messages::FieldError{v1::ERROR_CODE_RESOURCE_EXHAUSTED, std::move(text),
                                             telemetry::Refusal::colliders});
}

}  // namespace

RoomSurfaces::Owner* RoomSurfaces::findOwner(std::uint64_t participant) {
  const auto owner = std::ranges::lower_bound(owners_, participant, {}, &Owner::participant);
  return owner != owners_.end() && owner->participant == participant ? &*owner : nullptr;
}

RoomSurfaces::Entry* RoomSurfaces::findEntry(Owner& owner, std::uint32_t id) {
  const auto entry = std::ranges::lower_bound(owner.entries, id, {}, &Entry::id);
  return entry != owner.entries.end() && entry->id == id ? &*entry : nullptr;
}

RoomSurfaces::Entry* RoomSurfaces::findAwaiting(Owner* owner, const Ticket& ticket) {
  Entry* const entry = owner == nullptr ? nullptr : findEntry(*owner, ticket.id);
  return entry != nullptr && entry->number == ticket.number && entry->nextPose ? entry : nullptr;
}

std::size_t RoomSurfaces::trianglesOf(const Owner& owner) {
  std::size_t triangles = 0;
  for (const Entry& entry : owner.entries)
    if (entry.placed) triangles += entry.placed->table->surface.triangles.size();
  return triangles;
}

std::size_t RoomSurfaces::roomFor(const Owner& owner) const {
  std::size_t others = 0;
  for (const Owner& other : owners_)
    if (other.participant != owner.participant) others += trianglesOf(other);
  const std::size_t left =
      model::kMaxSceneSurfaceTriangles - std::min(others, model::kMaxSceneSurfaceTriangles);
  return std::min(left, std::max(left / 2, trianglesOf(owner)));
}

std::size_t RoomSurfaces::surfaceRoomFor(const Owner& owner) const {
  std::size_t others = 0;
  for (const Owner& other : owners_)
    if (other.participant != owner.participant) others += other.entries.size();
  const std::size_t left = model::kMaxSceneSurfaces - std::min(others, model::kMaxSceneSurfaces);
  return std::min(left, std::max(left / 2, owner.entries.size()));
}

void RoomSurfaces::forgetNext(Owner& owner, std::uint32_t id) {
  Entry* const entry = findEntry(owner, id);
  if (entry == nullptr) return;
  entry->nextPose.reset();
  if (!entry->placed) std::erase_if(owner.entries, [&](const Entry& one) { return one.id == id; });
}

void RoomSurfaces::changed() {
  ++version_;
}

messages::Result<void> RoomSurfaces::charge() {
  if (budget_ == nullptr) return {};
  SurfaceLoad load;
  double search = 0;
  for (const Owner& owner : owners_) {
    if (!owner.present) continue;
    for (const Entry& entry : owner.entries) {
      if (!entry.placed) continue;
      load.searches += model::kSurfaceTestWork;
      search = std::max(search, model::surfaceWork(entry.placed->table->surface));
      load.triangles += entry.placed->table->surface.triangles.size();
    }
  }
  load.searches += search;
  return budget_->chargeSurfaces(load);
}

void RoomSurfaces::add(std::uint64_t participant, Role role) {
  const std::lock_guard lock(mutex_);
  const auto place = std::ranges::lower_bound(owners_, participant, {}, &Owner::participant);
  owners_.insert(place, {.participant = participant, .role = role});
}

void RoomSurfaces::setRole(std::uint64_t participant, Role role) {
  const std::lock_guard lock(mutex_);
  Owner* const owner = findOwner(participant);
  if (owner == nullptr) return;
  owner->role = role;
  if (role != Role::viewer || owner->entries.empty()) return;
  owner->entries.clear();
  static_cast<void>(charge());  // fewer are never refused
  changed();
}

void RoomSurfaces::withdraw(std::uint64_t participant) {
  const std::lock_guard lock(mutex_);
  Owner* const owner = findOwner(participant);
  if (owner == nullptr || !std::exchange(owner->present, false)) return;
  // The participant sends what is not complete again when it is back.
  std::erase_if(owner->entries, [](const Entry& entry) { return !entry.placed; });
  for (Entry& entry : owner->entries) {
    entry.nextPose.reset();
    entry.number = 0;
  }
  static_cast<void>(charge());  // fewer are never refused
  changed();
}

void RoomSurfaces::resume(std::uint64_t participant) {
  const std::lock_guard lock(mutex_);
  Owner* const owner = findOwner(participant);
  if (owner == nullptr || std::exchange(owner->present, true)) return;
  // Without room for them, the participant sends its surfaces again and gets the error.
  if (!charge()) owner->entries.clear();
  changed();
}

void RoomSurfaces::remove(std::uint64_t participant) {
  const std::lock_guard lock(mutex_);
  if (std::erase_if(owners_, [&](const Owner& owner) { return owner.participant == participant; }) == 0)
    return;
  static_cast<void>(charge());  // fewer are never refused
  changed();
}

void RoomSurfaces::clear() {
  const std::lock_guard lock(mutex_);
  owners_.clear();
  static_cast<void>(charge());  // fewer are never refused
  changed();
}

messages::Result<RoomSurfaces::Ticket> RoomSurfaces::begin(std::uint64_t participant, std::uint32_t id,
                                                           const model::Pose& pose,
                                                           const Permissions& permissions) {
  const std::lock_guard lock(mutex_);
  Owner* const owner = findOwner(participant);
  if (owner == nullptr)
    return tl::unexpected(messages::FieldError{v1::ERROR_CODE_NOT_FOUND, "surface: you have left the scene"});
  if (auto permitted = permit(owner->role, Action::placeSurfaces, permissions); !permitted)
    return tl::unexpected(std::move(permitted.error()));
  Entry* entry = findEntry(*owner, id);
  if (entry == nullptr) {
    if (const std::size_t room = surfaceRoomFor(*owner); owner->entries.size() >= room)
      return noRoom(
          fmt::format("surface.id = {}: you have {} surfaces, and may have {}, half of those that others "
                      "leave of the {} of this scene; remove one first, or send fewer and larger ones",
                      id, owner->entries.size(), room, model::kMaxSceneSurfaces));
    const auto place = std::ranges::lower_bound(owner->entries, id, {}, &Entry::id);
    entry = &*owner->entries.insert(place, {.id = id, .placed = std::nullopt});
  }
  entry->number = ++newest_;
  entry->nextPose = pose;
  return Ticket{participant, id, entry->number};
}

messages::Result<void> RoomSurfaces::put(const Ticket& ticket, simulation::SharedSurface table, bool twoSided,
                                         float friction) {
  const std::lock_guard lock(mutex_);
  Owner* const owner = findOwner(ticket.participant);
  Entry* const entry = findAwaiting(owner, ticket);
  if (entry == nullptr) return {};
  const std::size_t before = entry->placed ? entry->placed->table->surface.triangles.size() : 0;
  const std::size_t all = trianglesOf(*owner) - before + table->surface.triangles.size();
  if (const std::size_t room = roomFor(*owner); all > room) {
    forgetNext(*owner, ticket.id);
    return noRoom(
        fmt::format("surface.id = {}: your surfaces would have {} triangles together; you may have {}, "
                    "half of those that others leave of the {} of this scene",
                    ticket.id, all, room, model::kMaxSceneSurfaceTriangles));
  }
  std::optional<simulation::PlacedSurface> former = std::exchange(
      entry->placed, simulation::PlacedSurface{std::move(table), *entry->nextPose, twoSided, friction});
  if (auto charged = charge(); !charged) {
    entry->placed = std::move(former);
    static_cast<void>(charge());  // as before
    forgetNext(*owner, ticket.id);
    charged.error().text = fmt::format("surface.id = {}: {}", ticket.id, charged.error().text);
    return charged;
  }
  entry->nextPose.reset();
  entry->revision = ticket.number;
  if (owner->present) changed();
  return {};
}

bool RoomSurfaces::isAwaited(const Ticket& ticket) {
  const std::lock_guard lock(mutex_);
  return findAwaiting(findOwner(ticket.participant), ticket) != nullptr;
}

void RoomSurfaces::cancel(const Ticket& ticket) {
  const std::lock_guard lock(mutex_);
  Owner* const owner = findOwner(ticket.participant);
  if (owner == nullptr) return;
  const Entry* const entry = findEntry(*owner, ticket.id);
  if (entry != nullptr && entry->number == ticket.number) forgetNext(*owner, ticket.id);
}

messages::Result<void> RoomSurfaces::move(std::uint64_t participant, std::uint32_t id,
                                          const model::Pose& pose) {
  const std::lock_guard lock(mutex_);
  Owner* const owner = findOwner(participant);
  Entry* const entry = owner == nullptr ? nullptr : findEntry(*owner, id);
  if (entry == nullptr)
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_NOT_FOUND,
        fmt::format("surface.id = {}: you have no such surface; send its mesh first", id)});
  if (entry->nextPose) entry->nextPose = pose;
  if (!entry->placed) return {};
  entry->placed->pose = pose;
  if (owner->present) changed();
  return {};
}

void RoomSurfaces::remove(std::uint64_t participant, std::uint32_t id) {
  const std::lock_guard lock(mutex_);
  Owner* const owner = findOwner(participant);
  if (owner == nullptr) return;
  if (std::erase_if(owner->entries, [&](const Entry& entry) { return entry.id == id; }) == 0) return;
  static_cast<void>(charge());  // fewer are never refused
  changed();
}

void RoomSurfaces::removeOthers(std::uint64_t participant, std::span<const std::uint32_t> ids) {
  const std::lock_guard lock(mutex_);
  Owner* const owner = findOwner(participant);
  if (owner == nullptr) return;
  const auto isOther = [&](const Entry& entry) { return !std::ranges::binary_search(ids, entry.id); };
  if (std::erase_if(owner->entries, isOther) == 0) return;
  static_cast<void>(charge());  // fewer are never refused
  changed();
}

std::size_t RoomSurfaces::roomOf(std::uint64_t participant) const {
  const std::lock_guard lock(mutex_);
  const auto owner = std::ranges::find(owners_, participant, &Owner::participant);
  return owner == owners_.end() ? 0 : roomFor(*owner);
}

bool RoomSurfaces::take(std::uint64_t& version, std::vector<RoomSurface>& surfaces) const {
  const std::lock_guard lock(mutex_);
  if (version == version_) return false;
  version = version_;
  surfaces.clear();
  for (const Owner& owner : owners_) {
    if (!owner.present) continue;
    for (const Entry& entry : owner.entries)
      if (entry.placed) surfaces.push_back({owner.participant, entry.id, *entry.placed, entry.revision});
  }
  return true;
}

std::optional<RoomSurface> RoomSurfaces::find(std::uint64_t participant, std::uint32_t id,
                                              std::uint64_t revision) const {
  const std::lock_guard lock(mutex_);
  const auto owner = std::ranges::find(owners_, participant, &Owner::participant);
  if (owner == owners_.end() || !owner->present) return std::nullopt;
  const auto entry = std::ranges::find(owner->entries, id, &Entry::id);
  if (entry == owner->entries.end() || !entry->placed || entry->revision != revision) return std::nullopt;
  return RoomSurface{participant, id, *entry->placed, revision};
}

}  // namespace clothstream::scene
