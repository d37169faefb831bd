// SPDX-License-Identifier: MIT
// Scenes that come from another server, and scenes that leave to one.
#include <algorithm>
#include <cstdint>
#include <exception>
#include <future>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/session.pb.h"
#include "server/hosting/server_state.h"
#include "server/telemetry/log.h"

namespace clothstream::hosting {
namespace {

tl::unexpected<v1::Error> cannotAdd(v1::ErrorCode code, std::string text) {
  return tl::unexpected(toMessage({code, std::move(text)}));
}

}  // namespace

tl::expected<SceneServer::State::HeldPlace, v1::Error> SceneServer::State::takePlace(
    const std::string& name, const std::string& tenant, bool isNew) {
  if (isNew && otherServerOf(name))
    return cannotAdd(
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("createScene: another server of the fleet has a scene '{}'; choose another name", name));
  const std::lock_guard lock(mutex);
  const auto created = static_cast<std::uint32_t>(
      std::ranges::count_if(scenes, [](const auto& scene) { return scene->created; }) + std::ssize(places));
  if (created >= options.maxCreatedScenes) {
    metrics.refuse(telemetry::Refusal::createdScenes);
    return cannotAdd(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                     fmt::format("the server has {} created scenes, its maximum: delete one first", created));
  }
  const auto ofTenant = static_cast<std::uint32_t>(
      std::ranges::count_if(scenes,
                            [&](const auto& scene) { return scene->created && scene->tenant == tenant; }) +
      std::ranges::count(places, tenant, &Place::tenant));
  if (ofTenant >= scenesPerTenant()) {
    metrics.refuse(telemetry::Refusal::scenesOfTenant);
    return cannotAdd(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                     fmt::format("your tenant has {} created scenes, its maximum (--max-scenes-per-tenant): "
                                 "delete one first",
                                 ofTenant));
  }
  if (std::ranges::any_of(scenes, [&](const auto& scene) { return scene->name() == name; }) ||
      std::ranges::count(places, name, &Place::name) > 0)
    return cannotAdd(v1::ERROR_CODE_INVALID_ARGUMENT,
                     fmt::format("createScene: a scene '{}' exists already; choose another name", name));
  places.push_back({++newestPlace, name, tenant});
  return HeldPlace(*this, newestPlace);
}

void SceneServer::State::leavePlace(std::uint64_t number) {
  const std::lock_guard lock(mutex);
  std::erase_if(places, [&](const Place& place) { return place.number == number; });
}

tl::expected<std::shared_ptr<scene::LiveScene>, std::string> SceneServer::State::prepareArrival(
    scene::SavedScene saved) try {
  auto place = takePlace(saved.start.name, saved.tenant, false);
  if (!place) return tl::unexpected(place.error().text());
  const auto scene = std::make_shared<scene::LiveScene>(
      saved.start, true, options.journals ? options.journals(saved.start) : nullptr,
      std::min(saved.maxParticipants, options.maxParticipants), budget);
  scene->tenant = saved.tenant;
  if (const auto charged = scene->charge(""); !charged) {
    metrics.refuse(telemetry::Refusal::budget);
    return tl::unexpected("it " + charged.error().text);
  }
  try {
    device.prepare(scene).get();
  } catch (const std::exception& failure) {
    scene->discharge();
    return tl::unexpected(fmt::format("the device cannot run it: {}", failure.what()));
  }
  place->keep();
  return scene;
} catch (const std::exception& failure) {  // such as a journal that cannot be made
  return tl::unexpected(std::string(failure.what()));
}

void SceneServer::State::startArrived(const std::shared_ptr<scene::LiveScene>& scene,
                                      scene::SavedScene saved) {
  raiseNewestParticipant(saved);
  scene->restore(std::move(saved), options.reconnectGrace, Clock::now());
  keep(scene);
  device.start(scene).get();
  insert(scene);
  telemetry::log({scene->name()}, spdlog::level::info, "came from another server, at tick {}",
                 scene->tick.load());
}

void SceneServer::State::abandonArrival(const std::shared_ptr<scene::LiveScene>& scene) {
  bool hasPlace = false;
  {
    const std::lock_guard lock(mutex);
    hasPlace = std::ranges::find(scenes, scene) == scenes.end();  // else insert() has ended it
  }
  removeCreated(scene, nullptr);
  if (!hasPlace) return;  // a place of this name would be that of another scene
  const std::lock_guard lock(mutex);
  std::erase_if(places, [&](const Place& place) { return place.name == scene->name(); });
}

void SceneServer::State::removeCreated(const std::shared_ptr<scene::LiveScene>& scene,
                                       const delivery::SharedBytes& last) {
  erase(*scene);
  scene->roster.close(last);
  device.remove(scene).wait();
  scene->discharge();
  if (scene->keeper) forget(*scene);  // else the name may be that of another scene
}

}  // namespace clothstream::hosting
