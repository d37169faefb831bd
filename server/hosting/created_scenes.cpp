// SPDX-License-Identifier: MIT
#include "server/hosting/created_scenes.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <future>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/hosting/answers.h"
#include "server/messages/field_error.h"
#include "server/telemetry/log.h"

namespace clothstream::hosting {
namespace {

// Interval at which a scene that is being loaded is checked for cancellation.
constexpr std::chrono::milliseconds kLoadingCheck{20};

}  // namespace

CreatedScenes::CreatedScenes(const ServerOptions& options, telemetry::ServerMetrics& metrics,
                             std::shared_ptr<scene::Budget> budget, SceneRegistry& scenes,
                             const KeptScenes& kept, DeviceThread& device)
    : options_(options),
      metrics_(metrics),
      budget_(std::move(budget)),
      scenes_(scenes),
      kept_(kept),
      device_(device) {}

std::shared_ptr<scene::LiveScene> CreatedScenes::madeFrom(const scene::SavedScene& saved) const {
  return std::make_shared<scene::LiveScene>(
      saved.start,
      scene::SceneTerms{.created = true,
                        .tenant = saved.tenant,
                        .maxParticipants = std::min(saved.maxParticipants, options_.maxParticipants)},
      options_.journals ? options_.journals(saved.start) : nullptr, budget_);
}

void CreatedScenes::restore() {
  std::uint32_t created = 0;
  for (scene::SavedScene& saved : kept_.takeCreated()) {
    const std::string name = saved.start.name;
    if (scenes_.find(name)) {
      telemetry::log({name}, spdlog::level::warn,
                     "the saved scene that a client created is not restored, and the server's scene of this "
                     "name is not saved; rename the server's scene, or start the server without it");
      continue;
    }
    std::shared_ptr<scene::LiveScene> scene = madeFrom(saved);
    kept_.resume(*scene, std::move(saved));
    messages::Result<void> charged = scene->charge("");
    if (created++ >= options_.maxCreatedScenes)
      charged = tl::unexpected(messages::FieldError{
          v1::ERROR_CODE_RESOURCE_EXHAUSTED,
          fmt::format("would be more than the {} created scenes that the server may have "
                      "(--max-created-scenes)",
                      options_.maxCreatedScenes)});
    if (!charged) {
      metrics_.refuse(telemetry::Refusal::budget);
      const std::string why = fmt::format(
          "the scene '{}' is kept from before a restart, but does not run: it {}; restart the server with "
          "room for it, or delete it",
          name, charged.error().text);
      telemetry::log({name}, spdlog::level::warn, "{}", why);
      scene->discharge();
      scene->terms.waitsForRoom = true;
      scene->quarantine(why);
    } else {
      kept_.keep(scene);
      device_.adopt(scene);
    }
    scenes_.insert(std::move(scene));
  }
}

tl::expected<std::shared_ptr<scene::LiveScene>, v1::Error> CreatedScenes::create(
    model::Scene definition, std::uint32_t maxParticipants, const std::string& tenant,
    const model::Cancellation& cancellation) {
  const auto place = scenes_.takePlace(definition.name, tenant, true);
  if (!place) return tl::unexpected(place.error());
  std::shared_ptr<scene::Journal> journal = options_.journals ? options_.journals(definition) : nullptr;
  auto scene = std::make_shared<scene::LiveScene>(
      std::move(definition),
      scene::SceneTerms{.created = true, .tenant = tenant, .maxParticipants = maxParticipants},
      std::move(journal), budget_);
  cancellation.check();
  if (auto charged = scene->charge(); !charged) {
    metrics_.refuse(telemetry::Refusal::budget);
    return refusal(charged.error().code, std::move(charged.error().text));
  }
  kept_.keep(scene);
  try {
    std::future<void> added = device_.add(scene);
    while (added.wait_for(kLoadingCheck) != std::future_status::ready) cancellation.check();
    added.get();
    cancellation.check();
    scenes_.insert(scene);
  } catch (const model::Cancelled&) {
    undoCreation(scene);
    throw;
  } catch (const std::exception& failure) {
    undoCreation(scene);
    return refusal(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                   fmt::format("createScene: the device cannot run it: {}", failure.what()));
  }
  return scene;
}

void CreatedScenes::undoCreation(const std::shared_ptr<scene::LiveScene>& scene) {
  // Nothing waits for the device here, because it may be what takes too long.
  device_.remove(scene);
  scene->discharge();
  kept_.forget(*scene);
}

tl::expected<ArrivingScene, std::string> CreatedScenes::prepareArrival(scene::SavedScene saved) try {
  auto place = scenes_.takePlace(saved.start.name, saved.tenant, false);
  if (!place) return tl::unexpected(place.error().text());
  std::shared_ptr<scene::LiveScene> scene = madeFrom(saved);
  if (const auto charged = scene->charge(""); !charged) {
    metrics_.refuse(telemetry::Refusal::budget);
    return tl::unexpected("it " + charged.error().text);
  }
  try {
    device_.prepare(scene).get();
  } catch (const std::exception& failure) {
    scene->discharge();
    return tl::unexpected(fmt::format("the device cannot run it: {}", failure.what()));
  }
  return ArrivingScene(*this, std::move(scene), std::move(*place));
} catch (const std::exception& failure) {  // such as a journal that cannot be made
  return tl::unexpected(std::string(failure.what()));
}

void CreatedScenes::startArrived(const std::shared_ptr<scene::LiveScene>& scene, scene::SavedScene saved) {
  kept_.resume(*scene, std::move(saved));
  kept_.keep(scene);
  device_.start(scene).get();
  scenes_.insert(scene);
  telemetry::log({scene->name()}, spdlog::level::info, "came from another server, at tick {}",
                 scene->tick.load());
}

void CreatedScenes::remove(const std::shared_ptr<scene::LiveScene>& scene,
                           const delivery::SharedBytes& last) {
  scenes_.erase(*scene);
  scene->roster.close(last);
  device_.remove(scene).wait();
  scene->discharge();
  if (scene->keeper) kept_.forget(*scene);  // else the name may be that of another scene
}

void ArrivingScene::start(scene::SavedScene saved) {
  created_->startArrived(scene_, std::move(saved));
  place_.reset();
}

void ArrivingScene::abandon() {
  if (!scene_ || !place_) return;
  created_->remove(scene_, nullptr);
  place_.reset();
  scene_.reset();
}

}  // namespace clothstream::hosting
