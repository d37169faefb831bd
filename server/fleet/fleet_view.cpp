// SPDX-License-Identifier: MIT
#include "server/fleet/fleet_view.h"

#include <fmt/format.h>

namespace clothstream::fleet {
namespace {

using namespace std::chrono_literals;

// A server that has not heard of its renewals for this long does not hear of those of others.
constexpr auto kSilenceOfServer = 2s, kLongestSilence = 4s;

}  // namespace

std::string keyOf(std::uint64_t origin) {
  return fmt::format("{:016x}", origin);
}

void FleetView::finishReading(const std::set<std::string>& present, Clock::time_point now) {
  std::erase_if(scenes_, [&](const auto& known) { return !present.contains(known.first); });
  readAt_ = now;
}

void FleetView::renew(const v1::ServerEntry& entry, bool isNew, Clock::time_point now) {
  Server& server = servers_[entry.origin()];
  // Renewals that were not heard may have been made.
  if (entry.origin() == self_ && now - server.renewed >= kSilenceOfServer) readAt_ = now;
  server = {.entry = entry, .renewed = now, .isNew = isNew};
}

void FleetView::removeServer(const std::string& key) {
  std::erase_if(servers_, [&](const auto& known) { return keyOf(known.first) == key; });
}

void FleetView::learn(const std::string& scene, const v1::SceneEntry& entry, std::uint64_t revision) {
  Scene& known = scenes_[scene];
  if (revision >= known.revision) known = {entry, revision};
}

void FleetView::replace(const std::string& scene, const v1::SceneEntry& entry, std::uint64_t revision) {
  scenes_[scene] = {entry, revision};
}

void FleetView::removeScene(const std::string& scene, std::uint64_t revision) {
  const auto found = scenes_.find(scene);
  if (found != scenes_.end() && found->second.revision <= revision) scenes_.erase(found);
}

const FleetView::Scene* FleetView::find(const std::string& scene) const {
  const auto found = scenes_.find(scene);
  return found == scenes_.end() ? nullptr : &found->second;
}

const FleetView::Server* FleetView::server(std::uint64_t origin) const {
  const auto found = servers_.find(origin);
  return found == servers_.end() ? nullptr : &found->second;
}

std::optional<std::uint64_t> FleetView::ownRevisionOf(const std::string& scene) const {
  const Scene* const known = find(scene);
  return known != nullptr && known->entry.origin() == self_ ? std::optional(known->revision) : std::nullopt;
}

bool FleetView::hears(Clock::time_point now) const {
  const Server* const self = server(self_);
  return reads_ && isSettled(now) && self != nullptr && now - self->renewed < kSilenceOfServer;
}

bool FleetView::isAlive(std::uint64_t origin, Clock::time_point now) const {
  const Server* const found = server(origin);
  return found != nullptr && (now - found->renewed < kLease || !hears(now));
}

std::vector<v1::ServerEntry> FleetView::others(Clock::time_point now) const {
  std::vector<v1::ServerEntry> others;
  for (const auto& [origin, server] : servers_)
    if (origin != self_ && isAlive(origin, now)) others.push_back(server.entry);
  return others;
}

bool FleetView::isSilent(Clock::time_point now) const {
  const Server* const self = server(self_);
  return now - (self == nullptr ? readAt_ : self->renewed) > kLongestSilence;
}

}  // namespace clothstream::fleet
