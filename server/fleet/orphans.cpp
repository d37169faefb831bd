// SPDX-License-Identifier: MIT
#include "server/fleet/orphans.h"

#include <chrono>

namespace clothstream::fleet {
namespace {

// The name of a scene without server is free again after this time.
constexpr std::chrono::seconds kContinuedBy{30};
constexpr int kMaxDelay = 500;  // ms

}  // namespace

void Orphans::add(const std::string& scene, Clock::time_point now) {
  const auto [orphan, isNew] = orphans_.try_emplace(scene, Orphan{now, now});
  if (isNew) orphan->second.adoptAt += std::chrono::milliseconds(random_() % kMaxDelay);
}

void Orphans::eraseIf(const std::function<bool(const std::string& scene)>& isGone) {
  std::erase_if(orphans_, [&](const auto& orphan) { return isGone(orphan.first); });
}

bool Orphans::isDue(const std::string& scene, Clock::time_point now) const {
  const auto found = orphans_.find(scene);
  return found != orphans_.end() && now >= found->second.adoptAt;
}

bool Orphans::mayContinue(const std::string& scene, Clock::time_point now) const {
  const auto found = orphans_.find(scene);
  return found == orphans_.end() || now - found->second.since < kContinuedBy;
}

}  // namespace clothstream::fleet
