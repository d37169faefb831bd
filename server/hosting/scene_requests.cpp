// SPDX-License-Identifier: MIT
#include "server/hosting/scene_requests.h"

#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "proto/text/printable.h"
#include "server/delivery/envelope.h"
#include "server/hosting/answers.h"
#include "server/messages/scene_message.h"
#include "server/scene/live_scene.h"

namespace clothstream::hosting {
namespace {

messages::Result<void> controlSource(scene::LiveScene& scene, const v1::ControlSceneRequest& request) {
  if (scene.source) return scene.source->control(request);
  const char* what = request.has_seek()    ? "seek"
                     : request.has_speed() ? "speed"
                     : request.has_loop()  ? "loop"
                                           : nullptr;
  if (what == nullptr) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_INVALID_ARGUMENT,
      fmt::format("controlScene.{}: only a played recording supports it; '{}' is simulated", what,
                  scene.name())});
}

}  // namespace

SceneRequests::SceneRequests(telemetry::ServerMetrics& metrics, const SceneRegistry& scenes,
                             DeviceThread& device)
    : metrics_(metrics), scenes_(scenes), device_(device) {}

v1::ListScenesResponse SceneRequests::list(const Identity& by) const {
  v1::ListScenesResponse response;
  for (const auto& scene : scenes_.all())
    if (by.reaches(scene->name())) *response.add_scenes() = summaryOf(*scene);
  return response;
}

tl::expected<v1::GetSceneResponse, v1::Error> SceneRequests::get(const v1::GetSceneRequest& request,
                                                                 std::size_t maxBytes) const {
  const std::shared_ptr<scene::LiveScene> scene = scenes_.find(request.name());
  if (!scene) return tl::unexpected(SceneRegistry::noSuchScene(request.name()));
  const auto tooLarge = [&](const char* qualifier, std::size_t bytes) {
    return refusal(
        v1::ERROR_CODE_RESOURCE_EXHAUSTED,
        fmt::format("getScene: '{}' takes {}{} bytes, and answers in a stream have at most {}: use the unary "
                    "call",
                    scene->name(), qualifier, bytes, maxBytes));
  };
  std::size_t positions = 0;
  for (const model::Cloth& cloth : scene->start().cloths)
    if (cloth.mesh) positions += 3 * sizeof(float) * cloth.nodeCount();
  if (positions > maxBytes) return tooLarge("at least ", positions);
  v1::GetSceneResponse response;
  *response.mutable_scene() =
      scene->source ? scene->source->description().definition() : messages::toMessage(scene->definition());
  if (const std::size_t bytes = response.ByteSizeLong(); bytes > maxBytes) return tooLarge("", bytes);
  return response;
}

tl::expected<v1::ControlSceneResponse, v1::Error> SceneRequests::control(
    const v1::ControlSceneRequest& request, std::uint64_t participant) {
  const std::shared_ptr<scene::LiveScene> scene = scenes_.find(request.name());
  if (!scene) return tl::unexpected(SceneRegistry::noSuchScene(request.name()));
  if (const auto counted = scene->countChange(participant, "controlScene"); !counted) {
    metrics_.refuse(*counted.error().limit);
    return tl::unexpected(toMessage(counted.error()));
  }
  if (const auto controlled = controlSource(*scene, request); !controlled)
    return tl::unexpected(toMessage(controlled.error()));
  if (request.has_paused() && scene->paused.exchange(request.paused()) != request.paused())
    scene->subscribers.announce(scene::pausedNotice(*scene, participant));
  if (request.reset()) {
    scene->resetRequested = true;
    scene->subscribers.announce(
        delivery::notice(v1::NOTICE_KIND_SCENE_RESET, "the scene is reset", scene->tick.load(), participant));
  }
  device_.wake(*scene);
  v1::ControlSceneResponse response;
  *response.mutable_scene() = summaryOf(*scene);
  return response;
}

tl::expected<v1::ListBansResponse, v1::Error> SceneRequests::listBans(
    const v1::ListBansRequest& request) const {
  const std::shared_ptr<scene::LiveScene> scene = scenes_.find(request.scene());
  if (!scene) return tl::unexpected(SceneRegistry::noSuchScene(request.scene()));
  v1::ListBansResponse response;
  for (const scene::Ban& ban : scene->roster.bans()) {
    v1::Ban& listed = *response.add_bans();
    listed.set_subject(ban.subject.name);
    listed.set_tenant(ban.subject.tenant);
    listed.set_display_name(ban.displayName);
  }
  return response;
}

tl::expected<v1::LiftBanResponse, v1::Error> SceneRequests::liftBan(const v1::LiftBanRequest& request) {
  const std::shared_ptr<scene::LiveScene> scene = scenes_.find(request.scene());
  if (!scene) return tl::unexpected(SceneRegistry::noSuchScene(request.scene()));
  if (!scene->roster.liftBan(request.subject()))
    return refusal(v1::ERROR_CODE_NOT_FOUND,
                   fmt::format("liftBan.subject = '{:.64}': the scene '{}' has no such ban",
                               printable(request.subject()), scene->name()));
  return v1::LiftBanResponse();
}

}  // namespace clothstream::hosting
