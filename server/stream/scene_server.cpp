// SPDX-License-Identifier: MIT
// The scenes of a server.
#include "server/stream/scene_server.h"

#include <cassert>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/messages/description.h"
#include "server/messages/limits.h"
#include "server/messages/scene_message.h"
#include "server/stream/server_state.h"
#include "server/stream/session.h"

namespace clothstream::stream {
namespace {

std::vector<std::unique_ptr<LiveScene>> liveScenes(std::vector<scene::Scene> definitions) {
  std::vector<std::unique_ptr<LiveScene>> scenes;
  scenes.reserve(definitions.size());
  for (scene::Scene& definition : definitions)
    scenes.push_back(std::make_unique<LiveScene>(std::move(definition)));
  return scenes;
}

SharedBytes stoppingNotice() {
  return notice(v1::NOTICE_KIND_SERVER_STOPPING, "the server stops", 0);
}

}  // namespace

SceneServer::State::State(std::vector<scene::Scene> definitions, ServerOptions options_)
    : options(std::move(options_)),
      scenes(liveScenes(std::move(definitions))),
      packer(scenes.size() * encode::FrameEncoder::kSlots,
             [this] {
               for (const auto& session : sessionsNow()) session->checkSilence(Clock::now());
             }),
      device(options.device, scenes, packer, metrics, options.runAlways, options.reportRate) {}

LiveScene* SceneServer::State::find(const std::string& name) const {
  for (const auto& scene : scenes)
    if (scene->name() == (name.empty() ? options.defaultScene : name)) return scene.get();
  return nullptr;
}

v1::Error SceneServer::State::noSuchScene(const std::string& name) const {
  std::string known;
  for (const auto& scene : scenes) known += (known.empty() ? "" : ", ") + scene->name();
  v1::Error error;
  error.set_code(v1::ERROR_CODE_NOT_FOUND);
  error.set_text(fmt::format("there is no scene '{:.64}'; there are {}", name, known));
  return error;
}

SharedBytes SceneServer::State::add(const std::shared_ptr<Session>& session) {
  const std::lock_guard lock(mutex);
  if (stopping) return stoppingNotice();
  std::erase_if(sessions, [](const auto& known) { return known.expired(); });
  if (sessions.size() >= options.maxConnections) {
    metrics.refusedConnections.add();
    return error(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                 fmt::format("the server has {} connections, as many as it may have; try again later",
                             sessions.size()),
                 true);
  }
  metrics.connections.add();
  sessions.push_back(session);
  return nullptr;
}

std::vector<std::shared_ptr<Session>> SceneServer::State::sessionsNow() const {
  const std::lock_guard lock(mutex);
  std::vector<std::shared_ptr<Session>> now;
  for (const auto& session : sessions)
    if (auto alive = session.lock()) now.push_back(std::move(alive));
  return now;
}

void SceneServer::State::stop() {
  {
    const std::lock_guard lock(mutex);
    stopping = true;
  }
  for (const auto& session : sessionsNow()) session->close(stoppingNotice());
}

v1::ListScenesResponse SceneServer::State::listScenes() const {
  v1::ListScenesResponse response;
  for (const auto& scene : scenes) {
    v1::SceneSummary& summary = *response.add_scenes();
    summary = messages::toSummary(scene->start());
    summary.set_participants(static_cast<std::uint32_t>(scene->audience.size()));
    summary.set_running(scene->running);
  }
  return response;
}

tl::expected<v1::GetSceneResponse, v1::Error> SceneServer::State::getScene(
    const v1::GetSceneRequest& request) const {
  const LiveScene* scene = find(request.name());
  if (scene == nullptr) return tl::unexpected(noSuchScene(request.name()));
  v1::GetSceneResponse response;
  *response.mutable_scene() = messages::toMessage(scene->definition());
  return response;
}

SceneServer::SceneServer(std::vector<scene::Scene> scenes, ServerOptions options) {
  assert(options.maxParticipants * messages::limits::kMaxParticipantColliders +
             messages::limits::kMaxColliders <=
         simulation::kMaxColliders);
  bool found = false;
  std::string known;
  for (const scene::Scene& scene : scenes) {
    found |= scene.name == options.defaultScene;
    known += (known.empty() ? "" : ", ") + scene.name;
  }
  if (!found)
    throw std::runtime_error(
        fmt::format("there is no scene '{}'; there are {}", options.defaultScene, known));
  state_ = std::make_unique<State>(std::move(scenes), std::move(options));
}

SceneServer::~SceneServer() {
  stop();
}

v1::ListScenesResponse SceneServer::listScenes() const {
  return state_->listScenes();
}

tl::expected<v1::GetSceneResponse, v1::Error> SceneServer::getScene(
    const v1::GetSceneRequest& request) const {
  return state_->getScene(request);
}

void SceneServer::stop() {
  state_->stop();
}

vulkan::DeviceInfo SceneServer::deviceInfo() const {
  return state_->device.info();
}

const std::string& SceneServer::defaultScene() const {
  return state_->options.defaultScene;
}

std::string SceneServer::report() const {
  std::string text;
  for (const auto& scene : state_->scenes)
    if (scene->metrics.ticks.value() > 0) text += telemetry::table(scene->name(), scene->metrics);
  return text + telemetry::table(state_->metrics);
}

}  // namespace clothstream::stream
