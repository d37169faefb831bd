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
#include "server/schedule/retry.h"
#include "server/telemetry/log.h"

namespace clothstream::hosting {
namespace {

tl::unexpected<v1::Error> cannotAdd(v1::ErrorCode code, std::string text) {
  return tl::unexpected(toMessage({code, std::move(text)}));
}

}  // namespace

tl::expected<void, v1::Error> SceneServer::State::roomFor(const std::string& name, const std::string& tenant,
                                                          bool isNew) {
  const std::vector<std::shared_ptr<scene::LiveScene>> present = scenesNow();
  const auto created = static_cast<std::uint32_t>(
      std::ranges::count_if(present, [](const auto& scene) { return scene->created; }));
  if (created >= options.maxCreatedScenes) {
    metrics.refuse(telemetry::Refusal::createdScenes);
    return cannotAdd(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                     fmt::format("the server has {} created scenes, its maximum: delete one first", created));
  }
  const auto ofTenant = static_cast<std::uint32_t>(std::ranges::count_if(
      present, [&](const auto& scene) { return scene->created && scene->tenant == tenant; }));
  if (ofTenant >= scenesPerTenant()) {
    metrics.refuse(telemetry::Refusal::scenesOfTenant);
    return cannotAdd(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                     fmt::format("your tenant has {} created scenes, its maximum (--max-scenes-per-tenant): "
                                 "delete one first",
                                 ofTenant));
  }
  if (std::ranges::any_of(present, [&](const auto& scene) { return scene->name() == name; }))
    return cannotAdd(v1::ERROR_CODE_INVALID_ARGUMENT,
                     fmt::format("createScene: a scene '{}' exists already; choose another name", name));
  if (isNew && otherServerOf(name))
    return cannotAdd(
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("createScene: another server of the fleet has a scene '{}'; choose another name", name));
  return {};
}

tl::expected<std::shared_ptr<scene::LiveScene>, std::string> SceneServer::State::prepareArrival(
    scene::SavedScene saved) {
  if (auto room = roomFor(saved.start.name, saved.tenant, false); !room)
    return tl::unexpected(room.error().text());
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
  return scene;
}

void SceneServer::State::startArrived(const std::shared_ptr<scene::LiveScene>& scene,
                                      scene::SavedScene saved) {
  if (find(scene->name())) throw std::runtime_error("a scene of this name was created meanwhile");
  raiseNewestParticipant(saved);
  scene->restore(std::move(saved), options.reconnectGrace, Clock::now());
  keep(scene);
  device.start(scene).get();
  insert(scene);
  telemetry::log({scene->name()}, spdlog::level::info, "came from another server, at tick {}",
                 scene->tick.load());
}

void SceneServer::State::abandonArrival(const std::shared_ptr<scene::LiveScene>& scene) {
  removeCreated(scene, nullptr);
}

void SceneServer::State::removeCreated(const std::shared_ptr<scene::LiveScene>& scene,
                                       const delivery::SharedBytes& last) {
  erase(*scene);
  const auto finish = [&] {
    scene->roster.close(last);
    device.remove(scene).wait();
    scene->discharge();
    if (scene->keeper) forget(*scene);  // else the name may be that of another scene
  };
  schedule::retryUntilDone(finish, [&](const std::exception& failure) {
    spdlog::error("{}: not removed: {}; trying again", scene->name(), failure.what());
  });
}

}  // namespace clothstream::hosting
