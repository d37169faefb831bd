// SPDX-License-Identifier: MIT
#include "server/hosting/scene_server.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "server/scene/scene_observer.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::hosting {
namespace {

// Viewers of a scene that is not simulated have numbers above this one, so that they differ from the
// participants in its frames.
constexpr std::uint64_t kFirstViewer = std::uint64_t{1} << 32;

// The default scene comes first, because the first scene is loaded when the server's constructor returns.
std::vector<model::Scene> defaultFirst(std::vector<model::Scene> scenes, const ServerOptions& options) {
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
  std::stable_partition(scenes.begin(), scenes.end(),
                        [&](const model::Scene& scene) { return scene.name == options.defaultScene; });
  return scenes;
}

// Number of threads: `asked`, or else as many as suit this machine.
std::uint32_t threadsOr(std::uint32_t (*suitedTo)(std::uint32_t), std::uint32_t asked) {
  return asked > 0 ? asked : suitedTo(std::thread::hardware_concurrency());
}

ServerOptions withDefaultScene(ServerOptions options, const std::string& name) {
  options.defaultScene = name;
  return options;
}

}  // namespace

SceneServer::SceneServer(std::vector<model::Scene>&& definitions, ServerOptions&& given, std::uint64_t newest)
    : options(std::move(given)),
      uploads(options.maxUploadBytes, options.maxUploadBytesOfAddress),
      budget(std::make_shared<scene::Budget>(options.budget)),
      newestParticipant(newest),
      kept(options, newestParticipant),
      scenes(options, metrics, startScenes(std::move(definitions))),
      connections(options, metrics),
      authentication(options, metrics),
      access(options, scenes),
      publisher(threadsOr(delivery::FramePublisher::suitedTo, options.encoderThreads),
                threadsOr(encode::WorkerThreads::suitedTo, options.encoderThreads)),
      device(options.device, scenes.all(), publisher, metrics, *budget, options.runAlways, options.reportRate,
             options.adaptsToLoad),
      created(options, metrics, budget, scenes, kept, device),
      maker(options, metrics, scenes, kept, created),
      requests(metrics, scenes, device),
      unaryCalls(access, requests, maker) {
  if (options.observer)
    for (const auto& scene : scenes.all()) scene->observe(options.observer->observe(*scene));
  created.restore();
  // Participants of an earlier run cannot come back before this time, however long the start took.
  for (const auto& scene : scenes.all()) scene->roster.restartGrace(options.reconnectGrace, Clock::now());
  housekeeping_ = std::jthread([this](const std::stop_token& stop) { keepHouse(stop); });
}

SceneServer::SceneServer(std::vector<model::Scene> definitions, ServerOptions given)
    : SceneServer(defaultFirst(std::move(definitions), given), std::move(given), 0) {}

SceneServer::SceneServer(std::string name, std::shared_ptr<scene::FrameSource> source, ServerOptions given)
    : SceneServer({}, withDefaultScene(std::move(given), name), kFirstViewer) {
  auto played =
      std::make_shared<scene::LiveScene>(std::move(name), std::move(source), options.maxParticipants);
  played->source->begin(*played);
  scenes.insert(std::move(played));
}

SceneServer::SceneServer(ServerOptions given) : SceneServer({}, std::move(given), kFirstViewer) {}

SceneServer::~SceneServer() {
  stop();
}

std::vector<std::shared_ptr<scene::LiveScene>> SceneServer::startScenes(
    std::vector<model::Scene> definitions) const {
  std::vector<std::shared_ptr<scene::LiveScene>> all;
  all.reserve(definitions.size());
  for (model::Scene& definition : definitions) {
    std::shared_ptr<scene::Journal> journal = options.journals ? options.journals(definition) : nullptr;
    const auto& scene = all.emplace_back(std::make_shared<scene::LiveScene>(
        std::move(definition), scene::SceneTerms{.maxParticipants = options.maxParticipants},
        std::move(journal), budget));
    scene->terms.sharesAsGuest =
        scene->name() != options.defaultScene && std::ranges::count(options.guestScenes, scene->name()) > 0;
    kept.restore(scene);
  }
  return all;
}

void SceneServer::keepHouse(const std::stop_token& stop) {
  telemetry::nameThread("housekeeping");
  std::mutex mutex;
  std::condition_variable_any never;  // wakes at a request to stop
  std::unique_lock lock(mutex);
  while (!stop.stop_requested()) {
    never.wait_for(lock, stop, std::chrono::seconds(1), [] { return false; });
    try {
      checkPeers(stop);
    } catch (const std::exception& failure) {
      spdlog::error("the check of every second failed: {}", failure.what());
    }
  }
}

void SceneServer::checkPeers(const std::stop_token& stop) {
  for (const auto& peer : connections.peers()) {
    if (stop.stop_requested()) return;
    peer->checkSilence(Clock::now());
  }
  for (const auto& scene : scenes.all()) {
    if (stop.stop_requested()) return;
    scene->roster.expire(Clock::now());
    scene->poses.divideRoom(Clock::now());
    if (options.roomSurfaces == SurfacePolicy::everyone) scene->announceSurfaces();
  }
}

std::shared_ptr<scene::LiveScene> SceneServer::add(std::string name,
                                                   std::shared_ptr<scene::FrameSource> source) {
  auto scene = std::make_shared<scene::LiveScene>(std::move(name), std::move(source), options.maxConnections);
  scene->source->begin(*scene);
  scenes.insert(scene);
  return scene;
}

void SceneServer::remove(const std::shared_ptr<scene::LiveScene>& scene, const delivery::SharedBytes& last) {
  scenes.erase(*scene);
  scene->source->end();
  scene->roster.close(last);
}

void SceneServer::stop() {
  maker.stop();
  connections.close();
  kept.flush();
}

std::string SceneServer::deviceNameOf(const scene::LiveScene& scene) const {
  return scene.source ? scene.source->deviceName() : device.info().name;
}

std::string SceneServer::report() const {
  std::string text;
  for (const auto& scene : scenes.all())
    if (scene->metrics.ticks.value() + scene->metrics.frames.value() > 0)
      text += telemetry::table(scene->name(), scene->metrics);
  return text + telemetry::table(metrics);
}

}  // namespace clothstream::hosting
