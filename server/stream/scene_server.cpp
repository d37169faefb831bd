// SPDX-License-Identifier: MIT
// The scenes of a server.
#include "server/stream/scene_server.h"

#include <algorithm>
#include <cassert>
#include <stdexcept>
#include <thread>
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

std::vector<std::shared_ptr<LiveScene>> liveScenes(std::vector<model::Scene> definitions,
                                                   const ServerOptions& options) {
  std::vector<std::shared_ptr<LiveScene>> scenes;
  scenes.reserve(definitions.size());
  for (model::Scene& definition : definitions) {
    std::shared_ptr<Journal> journal = options.journals ? options.journals(definition) : nullptr;
    scenes.push_back(std::make_shared<LiveScene>(std::move(definition), false, std::move(journal),
                                                 options.maxParticipants));
  }
  return scenes;
}

v1::Error toMessage(const messages::FieldError& error) {
  v1::Error message;
  message.set_code(error.code);
  message.set_text(error.text);
  return message;
}

// Participants of a recording and those who watch it are told apart by their numbers.
constexpr std::uint64_t kViewers = std::uint64_t{1} << 32;

SharedBytes stoppingNotice() {
  return notice(v1::NOTICE_KIND_SERVER_STOPPING, "the server stops", 0);
}

messages::Result<void> controlSource(LiveScene& scene, const v1::ControlSceneRequest& request) {
  if (scene.source) return scene.source->control(request);
  const char* what = request.has_seek()    ? "seek"
                     : request.has_speed() ? "speed"
                     : request.has_loop()  ? "loop"
                                           : nullptr;
  if (what == nullptr) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_INVALID_ARGUMENT,
      fmt::format("controlScene.{}: only a recording that is played has it; '{}' is simulated", what,
                  scene.name())});
}

}  // namespace

v1::SceneSummary summaryOf(const LiveScene& scene) {
  v1::SceneSummary summary = messages::toSummary(scene.start());
  if (scene.source) {
    const v1::StreamDescription& played = scene.source->description();
    std::uint32_t vertices = 0;
    for (const v1::ClothDescription& cloth : played.cloths()) vertices += cloth.vertex_count();
    summary.set_vertex_count(vertices);
    summary.set_cloth_count(static_cast<std::uint32_t>(played.cloths_size()));
    summary.set_description(played.definition().description());
    *summary.mutable_playback() = scene.source->playback();
  }
  summary.set_participants(static_cast<std::uint32_t>(scene.audience.size()));
  summary.set_max_participants(scene.maxParticipants);
  summary.set_running(scene.running);
  summary.set_paused(scene.paused);
  summary.set_created(scene.created);
  summary.set_recorded(scene.journal && scene.journal->active());
  return summary;
}

SceneServer::State::State(std::vector<model::Scene> definitions, ServerOptions options_)
    : options(std::move(options_)),
      uploads(options.maxUploadBytes),
      scenes(liveScenes(std::move(definitions), options)),
      packer((scenes.size() + options.maxCreatedScenes) * codec::kMaxQualities * encode::FrameEncoder::kSlots,
             [this] {
               for (const auto& session : sessionsNow()) session->checkSilence(Clock::now());
               for (const auto& scene : scenesNow()) scene->roster.expire(Clock::now());
             },
             options.encoderThreads > 0
                 ? options.encoderThreads
                 : encode::EncoderThreads::suitedTo(std::thread::hardware_concurrency())),
      device(options.device, scenes, packer, metrics, options.runAlways, options.reportRate),
      maker(*this) {}

SceneServer::State::State(std::shared_ptr<LiveScene> played, ServerOptions options_)
    : State(std::vector<model::Scene>{}, std::move(options_)) {
  participants = kViewers;
  played->source->begin(*played);
  insert(std::move(played));
}

std::string SceneServer::State::deviceNameOf(const LiveScene& scene) const {
  return scene.source ? scene.source->deviceName() : device.info().name;
}

void SceneServer::State::wake(const LiveScene& scene) {
  if (scene.source)
    scene.source->wake();
  else
    device.wake();
}

std::shared_ptr<LiveScene> SceneServer::State::find(const std::string& name) const {
  for (const auto& scene : scenesNow())
    if (scene->name() == (name.empty() ? options.defaultScene : name)) return scene;
  return nullptr;
}

std::vector<std::shared_ptr<LiveScene>> SceneServer::State::scenesNow() const {
  const std::lock_guard lock(mutex);
  return scenes;
}

void SceneServer::State::insert(std::shared_ptr<LiveScene> scene) {
  const std::lock_guard lock(mutex);
  scenes.push_back(std::move(scene));
}

void SceneServer::State::erase(const LiveScene& scene) {
  const std::lock_guard lock(mutex);
  std::erase_if(scenes, [&](const auto& known) { return known.get() == &scene; });
}

v1::Error SceneServer::State::noSuchScene(const std::string& name) const {
  std::string known;
  for (const auto& scene : scenesNow()) known += (known.empty() ? "" : ", ") + scene->name();
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
  for (const auto& scene : scenesNow()) *response.add_scenes() = summaryOf(*scene);
  return response;
}

tl::expected<v1::GetSceneResponse, v1::Error> SceneServer::State::getScene(
    const v1::GetSceneRequest& request) const {
  const std::shared_ptr<LiveScene> scene = find(request.name());
  if (!scene) return tl::unexpected(noSuchScene(request.name()));
  v1::GetSceneResponse response;
  *response.mutable_scene() =
      scene->source ? scene->source->description().definition() : messages::toMessage(scene->definition());
  return response;
}

messages::Result<void> SceneServer::State::mayFromOutside(const std::string& name, Act act) const {
  const std::shared_ptr<LiveScene> scene = find(name);
  if (options.outsideControl || !scene || !scene->roster.owned()) return {};
  messages::Result<void> permitted = permit(v1::ROLE_UNSPECIFIED, act, options.participantsMay);
  if (!permitted) permitted.error().text += fmt::format(", for you are not in the scene '{}'", scene->name());
  return permitted;
}

tl::expected<v1::ControlSceneResponse, v1::Error> SceneServer::State::controlScene(
    const v1::ControlSceneRequest& request, std::uint64_t participant) {
  const std::shared_ptr<LiveScene> scene = find(request.name());
  if (!scene) return tl::unexpected(noSuchScene(request.name()));
  if (const auto controlled = controlSource(*scene, request); !controlled)
    return tl::unexpected(toMessage(controlled.error()));
  if (request.has_paused() && scene->paused.exchange(request.paused()) != request.paused())
    scene->audience.announce(request.paused() ? pausedNotice(*scene, participant)
                                              : notice(v1::NOTICE_KIND_SCENE_RESUMED, "the scene goes on",
                                                       scene->tick.load(), participant));
  if (request.reset()) {
    scene->resetWanted = true;
    scene->audience.announce(
        notice(v1::NOTICE_KIND_SCENE_RESET, "the scene begins anew", scene->tick.load(), participant));
  }
  wake(*scene);
  v1::ControlSceneResponse response;
  *response.mutable_scene() = summaryOf(*scene);
  return response;
}

SceneServer::SceneServer(std::vector<model::Scene> scenes, ServerOptions options) {
  assert(options.maxParticipants <= kMostParticipants);
  bool found = false;
  std::string known;
  for (const model::Scene& scene : scenes) {
    found |= scene.name == options.defaultScene;
    known += (known.empty() ? "" : ", ") + scene.name;
  }
  if (!found)
    throw std::runtime_error(
        fmt::format("there is no scene '{}'; there are {}", options.defaultScene, known));
  // The first is ready when the server is.
  std::ranges::stable_partition(
      scenes, [&](const model::Scene& scene) { return scene.name == options.defaultScene; });
  state_ = std::make_unique<State>(std::move(scenes), std::move(options));
}

SceneServer::SceneServer(std::string name, std::shared_ptr<FrameSource> source, ServerOptions options) {
  options.defaultScene = name;
  auto played = std::make_shared<LiveScene>(std::move(name), std::move(source), options.maxParticipants);
  state_ = std::make_unique<State>(std::move(played), std::move(options));
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

void SceneServer::createScene(const v1::CreateSceneRequest& request, CreateDone done) {
  if (request.source_case() == v1::CreateSceneRequest::kUploadedContentId) {
    v1::Error error;
    error.set_code(v1::ERROR_CODE_NOT_FOUND);
    error.set_text("createScene.uploadedContentId: upload and ask in one joined stream");
    return done(tl::unexpected(std::move(error)));
  }
  state_->maker.create(request, {}, std::move(done));
}

void SceneServer::deleteScene(const v1::DeleteSceneRequest& request, DeleteDone done) {
  if (const auto may = state_->mayFromOutside(request.name(), Act::deleteScene); !may)
    return done(tl::unexpected(toMessage(may.error())));
  state_->maker.remove(request, std::move(done));
}

void SceneServer::startRecording(const v1::StartRecordingRequest& request, StartRecordingDone done) {
  if (const auto may = state_->mayFromOutside(request.scene(), Act::recordScene); !may)
    return done(tl::unexpected(toMessage(may.error())));
  state_->maker.startRecording(request, std::move(done));
}

void SceneServer::stopRecording(const v1::StopRecordingRequest& request, StopRecordingDone done) {
  if (const auto may = state_->mayFromOutside(request.scene(), Act::recordScene); !may)
    return done(tl::unexpected(toMessage(may.error())));
  state_->maker.stopRecording(request, std::move(done));
}

tl::expected<v1::ControlSceneResponse, v1::Error> SceneServer::controlScene(
    const v1::ControlSceneRequest& request) {
  if (const auto may = state_->mayFromOutside(request.name(), Act::controlScene); !may)
    return tl::unexpected(toMessage(may.error()));
  return state_->controlScene(request, 0);
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
  for (const auto& scene : state_->scenesNow())
    if (scene->metrics.ticks.value() + scene->metrics.frames.value() > 0)
      text += telemetry::table(scene->name(), scene->metrics);
  return text + telemetry::table(state_->metrics);
}

}  // namespace clothstream::stream
