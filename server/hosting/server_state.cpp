// SPDX-License-Identifier: MIT
#include "server/hosting/server_state.h"

#include <algorithm>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/session.pb.h"
#include "proto/text/printable.h"
#include "server/messages/description.h"
#include "server/messages/scene_message.h"
#include "server/scene/scene_observer.h"
#include "server/scene/scene_store.h"
#include "server/telemetry/log.h"

namespace clothstream::hosting {
namespace {

std::vector<std::shared_ptr<scene::LiveScene>> liveScenes(std::vector<model::Scene> definitions,
                                                          const ServerOptions& options,
                                                          const std::shared_ptr<scene::Budget>& budget) {
  std::vector<std::shared_ptr<scene::LiveScene>> scenes;
  scenes.reserve(definitions.size());
  for (model::Scene& definition : definitions) {
    std::shared_ptr<scene::Journal> journal = options.journals ? options.journals(definition) : nullptr;
    scenes.push_back(std::make_shared<scene::LiveScene>(std::move(definition), false, std::move(journal),
                                                        options.maxParticipants, budget));
    const std::string& name = scenes.back()->name();
    scenes.back()->sharesAsGuest =
        name != options.defaultScene && std::ranges::count(options.guestScenes, name) > 0;
  }
  return scenes;
}

// Longest wait for the disk before an answer, which is then given without it.
constexpr std::chrono::seconds kStorePatience{2};

delivery::SharedBytes stoppingNotice(std::chrono::milliseconds drain) {
  const float seconds = std::chrono::duration<float>(drain).count();
  v1::ServerMessage message;
  v1::Notice& notice = *message.mutable_notice();
  notice.set_kind(v1::NOTICE_KIND_SERVER_STOPPING);
  notice.set_text(fmt::format("the server is stopping; it ends within {} s", seconds));
  notice.set_ends_within_seconds(seconds);
  return delivery::serialise(message);
}

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

v1::Error toMessage(const messages::FieldError& error) {
  v1::Error message;
  message.set_code(error.code);
  message.set_text(error.text);
  return message;
}

v1::SceneSummary summaryOf(const scene::LiveScene& scene) {
  v1::SceneSummary summary = messages::toSummary(scene.start());
  if (scene.source) {
    const v1::StreamDescription& played = scene.source->description();
    std::uint32_t vertices = 0;
    for (const v1::ClothDescription& cloth : played.cloths()) vertices += cloth.vertex_count();
    summary.set_vertex_count(vertices);
    summary.set_cloth_count(static_cast<std::uint32_t>(played.cloths_size()));
    summary.set_description(played.definition().description());
    if (std::optional<v1::Playback> playback = scene.source->playback())
      *summary.mutable_playback() = std::move(*playback);
  }
  summary.set_participants(static_cast<std::uint32_t>(scene.subscribers.size()));
  summary.set_max_participants(scene.maxParticipants);
  summary.set_running(scene.running);
  summary.set_paused(scene.paused);
  summary.set_created(scene.created);
  summary.set_recorded(scene.journal && scene.journal->active());
  return summary;
}

SceneServer::State::State(std::vector<model::Scene> definitions, ServerOptions options_)
    : options(std::move(options_)),
      uploads(options.maxUploadBytes, options.maxUploadBytesOfAddress),
      budget(std::make_shared<scene::Budget>(options.budget)),
      scenes(liveScenes(std::move(definitions), options, budget)),
      publisher(
          (scenes.size() + options.maxCreatedScenes) * codec::kMaxQualities * encode::FrameEncoder::kSlots,
          [this] {
            for (const auto& peer : peersNow()) peer->checkSilence(Clock::now());
            if (!started) return;
            for (const auto& scene : scenesNow()) {
              scene->roster.expire(Clock::now());
              scene->poses.divideRoom(Clock::now());
            }
          },
          options.encoderThreads > 0 ? options.encoderThreads
                                     : encode::EncoderThreads::suitedTo(std::thread::hardware_concurrency())),
      device(options.device, restored(), publisher, metrics, *budget, options.runAlways, options.reportRate,
             options.adaptsToLoad),
      maker(*this) {
  if (options.observer)
    for (const auto& scene : scenes) scene->observe(options.observer->observe(*scene));
  restoreCreated();
  // Participants of an earlier run cannot come back before this time, however long the start took.
  for (const auto& scene : scenesNow()) scene->roster.restartGrace(options.reconnectGrace, Clock::now());
  started = true;
}

SceneServer::State::State(std::shared_ptr<scene::LiveScene> played, ServerOptions options_)
    : State(std::vector<model::Scene>{}, std::move(options_)) {
  participants = kFirstViewer;
  played->source->begin(*played);
  insert(std::move(played));
}

// A checkpoint may have participants who left after it.
void SceneServer::State::raiseNewestParticipant(const scene::SavedScene& saved) {
  const auto include = [&](std::uint64_t id) { participants = std::max(participants.load(), id); };
  for (const scene::SavedParticipant& known : saved.roster.participants) include(known.participant.id);
  if (!saved.checkpoint) return;
  for (const scene::ColliderSet::Placed& placed : saved.checkpoint->colliders.colliders)
    include(placed.participant);
  for (const scene::GrabsAndAttachments::Slot& slot : saved.checkpoint->grabs.slots)
    include(slot.participant);
}

const std::vector<std::shared_ptr<scene::LiveScene>>& SceneServer::State::restored() {
  if (!options.store) return scenes;
  for (const auto& scene : scenes) {
    if (auto saved = options.store->take(scene->start())) {
      raiseNewestParticipant(*saved);
      scene->restore(std::move(*saved), options.reconnectGrace, Clock::now());
    }
    scene->keeper = options.store->keep(scene);
  }
  return scenes;
}

void SceneServer::State::restoreCreated() {
  if (!options.store) return;
  std::uint32_t created = 0;
  for (scene::SavedScene& saved : options.store->takeCreated()) {
    const std::string name = saved.start.name;
    if (find(name)) {
      telemetry::log({name}, spdlog::level::warn,
                     "the saved scene that a client created is not restored, and the server's scene of this "
                     "name is not saved; rename the server's scene, or start the server without it");
      continue;
    }
    raiseNewestParticipant(saved);
    auto scene = std::make_shared<scene::LiveScene>(
        saved.start, true, options.journals ? options.journals(saved.start) : nullptr,
        std::min(saved.maxParticipants, options.maxParticipants), budget);
    scene->tenant = saved.tenant;
    scene->restore(std::move(saved), options.reconnectGrace, Clock::now());
    messages::Result<void> charged = scene->charge("");
    if (created++ >= options.maxCreatedScenes)
      charged = tl::unexpected(messages::FieldError{
          v1::ERROR_CODE_RESOURCE_EXHAUSTED,
          fmt::format("would be more than the {} created scenes that the server may have "
                      "(--max-created-scenes)",
                      options.maxCreatedScenes)});
    if (!charged) {
      metrics.refuse(telemetry::Refusal::budget);
      const std::string why = fmt::format(
          "the scene '{}' is kept from before a restart, but does not run: it {}; restart the server with "
          "room for it, or delete it",
          name, charged.error().text);
      telemetry::log({name}, spdlog::level::warn, "{}", why);
      scene->discharge();
      scene->waitsForRoom = true;
      scene->quarantine(why);
    } else {
      scene->keeper = options.store->keep(scene);
      device.adopt(scene);
    }
    insert(std::move(scene));
  }
}

void SceneServer::State::keep(const std::shared_ptr<scene::LiveScene>& scene) const {
  if (options.store) scene->keeper = options.store->keep(scene);
}

void SceneServer::State::forget(const scene::LiveScene& scene) const {
  if (options.store) options.store->remove(scene.name());
}

void SceneServer::State::flushStore(const scene::LiveScene& scene) const {
  if (options.store && !options.store->flush(kStorePatience, scene.name()))
    telemetry::log(
        {scene.name()}, spdlog::level::warn,
        "the disk is slow or full: what was just created or deleted may not survive the server's end");
}

std::string SceneServer::State::deviceNameOf(const scene::LiveScene& scene) const {
  return scene.source ? scene.source->deviceName() : device.info().name;
}

void SceneServer::State::wake(const scene::LiveScene& scene) {
  if (scene.source)
    scene.source->wake();
  else
    device.wake();
}

std::shared_ptr<scene::LiveScene> SceneServer::State::find(const std::string& name) const {
  const std::string& wanted = name.empty() ? options.defaultScene : name;
  for (const auto& scene : scenesNow())
    if (scene->name() == wanted || wanted.empty()) return scene;
  return nullptr;
}

std::vector<std::shared_ptr<scene::LiveScene>> SceneServer::State::scenesNow() const {
  const std::lock_guard lock(mutex);
  return scenes;
}

void SceneServer::State::insert(std::shared_ptr<scene::LiveScene> scene) {
  if (options.observer) scene->observe(options.observer->observe(*scene));
  const std::lock_guard lock(mutex);
  scenes.push_back(std::move(scene));
  std::erase_if(places, [&](const Place& place) { return place.name == scenes.back()->name(); });
}

void SceneServer::State::erase(const scene::LiveScene& scene) {
  const std::lock_guard lock(mutex);
  std::erase_if(scenes, [&](const auto& known) { return known.get() == &scene; });
}

v1::Error SceneServer::State::noSuchScene(const std::string& name, const Identity& by) const {
  v1::Error error = noSuchScene(name);
  std::string known;
  for (const auto& scene : scenesNow())
    if (by.reaches(scene->name())) known += (known.empty() ? "; there are " : ", ") + scene->name();
  error.mutable_text()->append(known);
  return error;
}

v1::Error SceneServer::State::noSuchScene(const std::string& name) {
  v1::Error error;
  error.set_code(v1::ERROR_CODE_NOT_FOUND);
  error.set_text(fmt::format("there is no scene '{:.64}'", printable(name)));
  return error;
}

std::optional<std::string> SceneServer::State::otherServerOf(const std::string& scene) const {
  const std::lock_guard lock(mutex);
  return otherServers ? otherServers(scene) : std::nullopt;
}

void SceneServer::State::setOtherServers(FindServer find) {
  const std::lock_guard lock(mutex);
  otherServers = std::move(find);
}

delivery::SharedBytes SceneServer::State::admit(const std::shared_ptr<Peer>& peer) {
  const std::lock_guard lock(mutex);
  if (stopping) {
    metrics.refuse(telemetry::Refusal::stopping);
    return stoppingNotice(options.drain);
  }
  std::erase_if(peers, [](const auto& known) { return known.expired(); });
  if (peers.size() >= options.maxConnections) {
    metrics.refuse(telemetry::Refusal::connections);
    return delivery::error(
        v1::ERROR_CODE_RESOURCE_EXHAUSTED,
        fmt::format("the server has {} connections, its maximum; try again later", peers.size()), true);
  }
  metrics.connections.add();
  peers.push_back(peer);
  return nullptr;
}

std::vector<std::shared_ptr<Peer>> SceneServer::State::peersNow() const {
  const std::lock_guard lock(mutex);
  std::vector<std::shared_ptr<Peer>> now;
  for (const auto& peer : peers)
    if (auto alive = peer.lock()) now.push_back(std::move(alive));
  return now;
}

void SceneServer::State::stop() {
  {
    const std::lock_guard lock(mutex);
    stopping = true;
  }
  maker.stop();
  const delivery::SharedBytes notice = stoppingNotice(options.drain);
  for (const auto& peer : peersNow()) peer->close(notice);
  if (options.store) options.store->flush(kStorePatience);
}

v1::ListScenesResponse SceneServer::State::listScenes(const Identity& by) const {
  v1::ListScenesResponse response;
  for (const auto& scene : scenesNow())
    if (by.reaches(scene->name())) *response.add_scenes() = summaryOf(*scene);
  return response;
}

tl::expected<v1::GetSceneResponse, v1::Error> SceneServer::State::getScene(const v1::GetSceneRequest& request,
                                                                           std::size_t maxBytes) const {
  const std::shared_ptr<scene::LiveScene> scene = find(request.name());
  if (!scene) return tl::unexpected(noSuchScene(request.name()));
  const auto tooLarge = [&](const char* qualifier, std::size_t bytes) {
    return tl::unexpected(toMessage(
        {v1::ERROR_CODE_RESOURCE_EXHAUSTED,
         fmt::format(
             "getScene: '{}' takes {}{} bytes, and answers in a stream have at most {}: use the unary "
             "call",
             scene->name(), qualifier, bytes, maxBytes)}));
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

tl::expected<v1::ControlSceneResponse, v1::Error> SceneServer::State::controlScene(
    const v1::ControlSceneRequest& request, std::uint64_t participant) {
  const std::shared_ptr<scene::LiveScene> scene = find(request.name());
  if (!scene) return tl::unexpected(noSuchScene(request.name()));
  if (const auto counted = scene->countChange(participant, "controlScene"); !counted) {
    metrics.refuse(*counted.error().limit);
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
  wake(*scene);
  v1::ControlSceneResponse response;
  *response.mutable_scene() = summaryOf(*scene);
  return response;
}

}  // namespace clothstream::hosting
