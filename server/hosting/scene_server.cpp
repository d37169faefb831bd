// SPDX-License-Identifier: MIT
#include "server/hosting/scene_server.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/hosting/server_state.h"

namespace clothstream::hosting {

SceneServer::SceneServer(std::vector<model::Scene> scenes, ServerOptions options) {
  assert(options.maxParticipants <= kMaxParticipants);
  bool found = false;
  std::string known;
  for (const model::Scene& scene : scenes) {
    found |= scene.name == options.defaultScene;
    known += (known.empty() ? "" : ", ") + scene.name;
  }
  if (!found)
    throw std::runtime_error(
        fmt::format("there is no scene '{}'; there are {}", options.defaultScene, known));
  // The first scene is loaded when the constructor returns.
  std::stable_partition(scenes.begin(), scenes.end(),
                        [&](const model::Scene& scene) { return scene.name == options.defaultScene; });
  state_ = std::make_unique<State>(std::move(scenes), std::move(options));
}

SceneServer::SceneServer(std::string name, std::shared_ptr<scene::FrameSource> source,
                         ServerOptions options) {
  options.defaultScene = name;
  auto played =
      std::make_shared<scene::LiveScene>(std::move(name), std::move(source), options.maxParticipants);
  state_ = std::make_unique<State>(std::move(played), std::move(options));
}

SceneServer::SceneServer(ServerOptions options) {
  state_ = std::make_unique<State>(std::vector<model::Scene>{}, std::move(options));
  state_->participants = State::kFirstViewer;
}

std::shared_ptr<scene::LiveScene> SceneServer::add(std::string name,
                                                   std::shared_ptr<scene::FrameSource> source) {
  auto scene =
      std::make_shared<scene::LiveScene>(std::move(name), std::move(source), state_->options.maxConnections);
  scene->source->begin(*scene);
  state_->insert(scene);
  return scene;
}

void SceneServer::remove(const std::shared_ptr<scene::LiveScene>& scene, const delivery::SharedBytes& last) {
  state_->erase(*scene);
  scene->source->end();
  scene->roster.close(last);
}

SceneServer::~SceneServer() {
  stop();
}

v1::ListScenesResponse SceneServer::listScenes(const Identity& by) const {
  return state_->listScenes(by);
}

tl::expected<v1::GetSceneResponse, v1::Error> SceneServer::getScene(const v1::GetSceneRequest& request,
                                                                    const Identity& by) const {
  if (const auto may = state_->mayUse(by, request.name()); !may)
    return tl::unexpected(toMessage(may.error()));
  return state_->getScene(request);
}

void SceneServer::createScene(const v1::CreateSceneRequest& request, const CreateDone& done,
                              const Identity& by, Wanted wanted) {
  if (const auto may = state_->mayCreate(by); !may) return done(tl::unexpected(toMessage(may.error())));
  if (request.source_case() == v1::CreateSceneRequest::kUploadedContentId) {
    v1::Error error;
    error.set_code(v1::ERROR_CODE_NOT_FOUND);
    error.set_text("createScene.uploadedContentId: upload the scene and create it in the same stream");
    return done(tl::unexpected(std::move(error)));
  }
  if (auto accepted = state_->maker.create(request, {}, by.subject.tenant, std::move(wanted), done);
      !accepted)
    done(tl::unexpected(std::move(accepted.error())));
}

void SceneServer::deleteScene(const v1::DeleteSceneRequest& request, DeleteDone done, const Identity& by) {
  if (const auto may = state_->mayFromOutside(by, request.name(), scene::Action::deleteScene); !may)
    return done(tl::unexpected(toMessage(may.error())));
  if (auto accepted = state_->maker.remove(request, done); !accepted)
    done(tl::unexpected(std::move(accepted.error())));
}

void SceneServer::startRecording(const v1::StartRecordingRequest& request, StartRecordingDone done,
                                 const Identity& by) {
  if (const auto may = state_->mayFromOutside(by, request.scene(), scene::Action::recordScene); !may)
    return done(tl::unexpected(toMessage(may.error())));
  if (auto accepted = state_->maker.startRecording(request, done); !accepted)
    done(tl::unexpected(std::move(accepted.error())));
}

void SceneServer::stopRecording(const v1::StopRecordingRequest& request, StopRecordingDone done,
                                const Identity& by) {
  if (const auto may = state_->mayFromOutside(by, request.scene(), scene::Action::recordScene); !may)
    return done(tl::unexpected(toMessage(may.error())));
  if (auto accepted = state_->maker.stopRecording(request, done); !accepted)
    done(tl::unexpected(std::move(accepted.error())));
}

tl::expected<v1::ControlSceneResponse, v1::Error> SceneServer::controlScene(
    const v1::ControlSceneRequest& request, const Identity& by) {
  if (const auto may = state_->mayFromOutside(by, request.name(), scene::Action::controlScene); !may)
    return tl::unexpected(toMessage(may.error()));
  return state_->controlScene(request, 0);
}

void SceneServer::stop() {
  state_->stop();
}

vulkan::DeviceInfo SceneServer::deviceInfo() const {
  return state_->device.info();
}

std::string SceneServer::report() const {
  std::string text;
  for (const auto& scene : state_->scenesNow())
    if (scene->metrics.ticks.value() + scene->metrics.frames.value() > 0)
      text += telemetry::table(scene->name(), scene->metrics);
  return text + telemetry::table(state_->metrics);
}

}  // namespace clothstream::hosting
