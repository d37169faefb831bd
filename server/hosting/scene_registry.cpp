// SPDX-License-Identifier: MIT
#include "server/hosting/scene_registry.h"

#include <algorithm>
#include <iterator>

#include <fmt/format.h>

#include "proto/text/printable.h"
#include "server/hosting/answers.h"
#include "server/scene/scene_observer.h"

namespace clothstream::hosting {

SceneRegistry::SceneRegistry(const ServerOptions& options, telemetry::ServerMetrics& metrics,
                             std::vector<std::shared_ptr<scene::LiveScene>> scenes)
    : options_(options), metrics_(metrics), scenes_(std::move(scenes)) {}

std::shared_ptr<scene::LiveScene> SceneRegistry::find(const std::string& name) const {
  const std::string& wanted = name.empty() ? options_.defaultScene : name;
  const std::lock_guard lock(mutex_);
  for (const auto& scene : scenes_)
    if (scene->name() == wanted || wanted.empty()) return scene;
  return nullptr;
}

std::vector<std::shared_ptr<scene::LiveScene>> SceneRegistry::all() const {
  const std::lock_guard lock(mutex_);
  return scenes_;
}

void SceneRegistry::insert(std::shared_ptr<scene::LiveScene> scene) {
  if (options_.observer) scene->observe(options_.observer->observe(*scene));
  const std::lock_guard lock(mutex_);
  scenes_.push_back(std::move(scene));
  std::erase_if(places_, [&](const Taken& place) { return place.name == scenes_.back()->name(); });
}

void SceneRegistry::erase(const scene::LiveScene& scene) {
  const std::lock_guard lock(mutex_);
  std::erase_if(scenes_, [&](const auto& known) { return known.get() == &scene; });
}

v1::Error SceneRegistry::noSuchScene(const std::string& name, const Identity& by) const {
  v1::Error error = noSuchScene(name);
  std::string known;
  for (const auto& scene : all())
    if (by.reaches(scene->name())) known += (known.empty() ? "; there are " : ", ") + scene->name();
  error.mutable_text()->append(known);
  return error;
}

v1::Error SceneRegistry::noSuchScene(const std::string& name) {
  return toMessage({v1::ERROR_CODE_NOT_FOUND, fmt::format("there is no scene '{:.64}'", printable(name))});
}

std::optional<std::string> SceneRegistry::otherServerOf(const std::string& scene) const {
  const std::lock_guard lock(mutex_);
  return otherServers_ ? otherServers_(scene) : std::nullopt;
}

void SceneRegistry::setOtherServers(FindServer find) {
  const std::lock_guard lock(mutex_);
  otherServers_ = std::move(find);
}

tl::expected<SceneRegistry::Place, v1::Error> SceneRegistry::takePlace(const std::string& name,
                                                                       const std::string& tenant,
                                                                       bool isNew) {
  if (isNew && otherServerOf(name))
    return refusal(
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("createScene: another server of the fleet has a scene '{}'; choose another name", name));
  const std::lock_guard lock(mutex_);
  const auto created = static_cast<std::uint32_t>(
      std::ranges::count_if(scenes_, [](const auto& scene) { return scene->terms.created; }) +
      std::ssize(places_));
  if (created >= options_.maxCreatedScenes) {
    metrics_.refuse(telemetry::Refusal::createdScenes);
    return refusal(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                   fmt::format("the server has {} created scenes, its maximum: delete one first", created));
  }
  const auto ofTenant = static_cast<std::uint32_t>(
      std::ranges::count_if(
          scenes_, [&](const auto& scene) { return scene->terms.created && scene->terms.tenant == tenant; }) +
      std::ranges::count(places_, tenant, &Taken::tenant));
  if (ofTenant >= options_.scenesPerTenant()) {
    metrics_.refuse(telemetry::Refusal::scenesOfTenant);
    return refusal(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                   fmt::format("your tenant has {} created scenes, its maximum (--max-scenes-per-tenant): "
                               "delete one first",
                               ofTenant));
  }
  if (std::ranges::any_of(scenes_, [&](const auto& scene) { return scene->name() == name; }) ||
      std::ranges::count(places_, name, &Taken::name) > 0)
    return refusal(v1::ERROR_CODE_INVALID_ARGUMENT,
                   fmt::format("createScene: a scene '{}' exists already; choose another name", name));
  places_.push_back({++newestPlace_, name, tenant});
  return Place(*this, newestPlace_);
}

void SceneRegistry::leavePlace(std::uint64_t number) {
  const std::lock_guard lock(mutex_);
  std::erase_if(places_, [&](const Taken& place) { return place.number == number; });
}

}  // namespace clothstream::hosting
