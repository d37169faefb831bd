// SPDX-License-Identifier: MIT
#include "server/hosting/kept_scenes.h"

#include <chrono>
#include <optional>
#include <utility>

#include <spdlog/spdlog.h>

#include "server/scene/scene_store.h"
#include "server/schedule/clock.h"
#include "server/telemetry/log.h"

namespace clothstream::hosting {
namespace {

// Longest wait for the disk before an answer, which is then given without it.
constexpr std::chrono::seconds kStorePatience{2};

}  // namespace

KeptScenes::KeptScenes(const ServerOptions& options, std::atomic<std::uint64_t>& newestParticipant)
    : options_(options), newestParticipant_(newestParticipant) {}

void KeptScenes::restore(const std::shared_ptr<scene::LiveScene>& scene) const {
  if (!options_.store) return;
  if (std::optional<scene::SavedScene> saved = options_.store->take(scene->start()))
    resume(*scene, std::move(*saved));
  keep(scene);
}

std::vector<scene::SavedScene> KeptScenes::takeCreated() const {
  return options_.store ? options_.store->takeCreated() : std::vector<scene::SavedScene>();
}

void KeptScenes::resume(scene::LiveScene& scene, scene::SavedScene saved) const {
  const auto include = [this](std::uint64_t id) {
    std::uint64_t newest = newestParticipant_;
    while (newest < id && !newestParticipant_.compare_exchange_weak(newest, id)) {
    }
  };
  for (const scene::SavedParticipant& known : saved.roster.participants) include(known.participant.id);
  // A checkpoint may have participants who left after it.
  if (saved.checkpoint) {
    for (const scene::ColliderSet::Placed& placed : saved.checkpoint->colliders.colliders)
      include(placed.participant);
    for (const scene::GrabsAndAttachments::Slot& slot : saved.checkpoint->grabs.slots)
      include(slot.participant);
  }
  scene.restore(std::move(saved), options_.reconnectGrace, schedule::Clock::now());
}

void KeptScenes::keep(const std::shared_ptr<scene::LiveScene>& scene) const {
  if (options_.store) scene->keeper = options_.store->keep(scene);
}

void KeptScenes::forget(const scene::LiveScene& scene) const {
  if (options_.store) options_.store->remove(scene.name());
}

void KeptScenes::flush(const scene::LiveScene& scene) const {
  if (options_.store && !options_.store->flush(kStorePatience, scene.name()))
    telemetry::log(
        {scene.name()}, spdlog::level::warn,
        "the disk is slow or full: what was just created or deleted may not survive the server's end");
}

void KeptScenes::flush() const {
  if (options_.store) options_.store->flush(kStorePatience);
}

}  // namespace clothstream::hosting
