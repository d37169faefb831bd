// SPDX-License-Identifier: MIT
#include "server/hosting/scene_maker.h"

#include <algorithm>
#include <exception>
#include <memory>
#include <span>
#include <utility>

#include <boost/asio/post.hpp>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/session.pb.h"
#include "server/hosting/answers.h"
#include "server/messages/limits.h"
#include "server/messages/parsed_size.h"
#include "server/messages/scene_file.h"
#include "server/messages/scene_message.h"
#include "server/messages/validation.h"
#include "server/telemetry/log.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::hosting {
namespace {

// Returns the result of `work`. An exception, such as for a directory of recordings that cannot be written,
// becomes an error for the peer that asked.
template <class Work>
auto attempt(const char* call, const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::exception& failure) {
    spdlog::error("{}: {}", call, failure.what());
    return refusal(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                   fmt::format("{}: failed on the server: {}", call, failure.what()));
  }
}

// Counts a waiting request until it is reset or destroyed.
struct EndWaiting {
  void operator()(std::atomic<std::uint32_t>* count) const { --*count; }
};
using Waiting = std::unique_ptr<std::atomic<std::uint32_t>, EndWaiting>;

}  // namespace

SceneMaker::SceneMaker(const ServerOptions& options, telemetry::ServerMetrics& metrics,
                       const SceneRegistry& scenes, const KeptScenes& kept, CreatedScenes& created)
    : options_(options), metrics_(metrics), scenes_(scenes), kept_(kept), created_(created) {
  boost::asio::post(thread_, [this] {
    telemetry::nameThread("scene maker");
    expireLater();
  });
}

SceneMaker::~SceneMaker() {
  stop();
  boost::asio::post(thread_, [this] {
    ended_ = true;
    expiry_.cancel();
  });
  thread_.join();
}

void SceneMaker::expireLater() {
  const std::chrono::milliseconds lifetime = options_.sceneLifetime;
  if (lifetime.count() == 0 || ended_) return;
  constexpr std::chrono::milliseconds kInterval{1000};
  const std::chrono::milliseconds interval = std::min(lifetime, kInterval);
  expiry_.expires_after(interval);
  expiry_.async_wait([this, lifetime](const boost::system::error_code& cancelled) {
    if (cancelled) return;
    deleteUnused(lifetime);
    expireLater();
  });
}

void SceneMaker::deleteUnused(std::chrono::milliseconds lifetime) {
  for (const auto& scene : scenes_.all()) {
    // A scene that waits for room cannot be used.
    if (!scene->terms.created || scene->terms.waitsForRoom || !scene->hasBeenEmptyFor(lifetime, Clock::now()))
      continue;
    v1::DeleteSceneRequest request;
    request.set_name(scene->name());
    spdlog::info("{}: unused for {} s", scene->name(), schedule::seconds(lifetime));
    // A peer that joins in this moment gets this text.
    const std::string why = fmt::format(
        "has expired, because it had no participants for {} s (--scene-lifetime): create it again",
        schedule::seconds(lifetime));
    attempt("deleteScene", [&] { return removeNow(request, why); });
  }
}

tl::expected<void, v1::Error> SceneMaker::create(v1::CreateSceneRequest request,
                                                 std::optional<UploadedContent> uploaded, std::string tenant,
                                                 Wanted wanted, CreateDone done) {
  const bool isFull = ++waiting_ > kMaxWaiting;
  Waiting waits(&waiting_);
  if (isFull) {
    metrics_.refuse(telemetry::Refusal::waitingScenes);
    return refusal(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                   fmt::format("createScene: {} scenes wait to be created; try again later", kMaxWaiting));
  }
  boost::asio::post(thread_, [this, waits = std::move(waits), request = std::move(request),
                              uploaded = std::move(uploaded), tenant = std::move(tenant),
                              wanted = std::move(wanted), done = std::move(done)]() mutable {
    waits.reset();
    static const std::string nothing;
    const auto end = Clock::now() + options_.maxCreationTime;
    const model::Cancellation cancellation(
        [&] { return stopping_ || (wanted && !wanted()) || Clock::now() > end; });
    auto made = attempt("createScene", [&]() -> tl::expected<v1::CreateSceneResponse, v1::Error> {
      try {
        cancellation.check();
        return createNow(request, uploaded ? uploaded->bytes : nothing, tenant, cancellation);
      } catch (const model::Cancelled&) {
        if (stopping_)
          return refusal(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                         "createScene: cancelled, because the server stops; create the scene again when the "
                         "server runs again");
        if (Clock::now() <= end)
          return refusal(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                         "createScene: cancelled, because the peer that asked for it has left; connect and "
                         "create the scene again");
        metrics_.refuse(telemetry::Refusal::creationTime);
        return refusal(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                       fmt::format("createScene: takes longer than {} s (--profile); make the "
                                   "scene smaller",
                                   schedule::seconds(options_.maxCreationTime)));
      }
    });
    uploaded.reset();  // before the answer, so that the peer may upload again at once
    done(std::move(made));
  });
  return {};
}

template <class Work, class Done>
tl::expected<void, v1::Error> SceneMaker::enqueue(const char* call, Work work, Done done) {
  const bool isFull = ++requests_ > kMaxWaiting;
  Waiting waits(&requests_);
  if (isFull) {
    metrics_.refuse(telemetry::Refusal::waitingScenes);
    return refusal(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                   fmt::format("{}: {} requests about scenes wait; try again later", call, kMaxWaiting));
  }
  boost::asio::post(
      thread_, [waits = std::move(waits), call, work = std::move(work), done = std::move(done)]() mutable {
        waits.reset();
        done(attempt(call, work));
      });
  return {};
}

tl::expected<void, v1::Error> SceneMaker::remove(v1::DeleteSceneRequest request, DeleteDone done) {
  return enqueue(
      "deleteScene", [this, request = std::move(request)] { return removeNow(request, "was deleted"); },
      std::move(done));
}

tl::expected<std::shared_ptr<scene::Journal>, v1::Error> SceneMaker::journalOf(
    const std::string& call, const std::string& name) const {
  const std::shared_ptr<scene::LiveScene> scene = scenes_.find(name);
  if (!scene) return tl::unexpected(SceneRegistry::noSuchScene(name));
  if (scene->source)
    return refusal(v1::ERROR_CODE_INVALID_ARGUMENT,
                   fmt::format("{}: '{}' is a recording that is played", call, scene->name()));
  if (!scene->journal) {
    messages::FieldError error = scene::noJournalError(call);
    return refusal(error.code, std::move(error.text));
  }
  return scene->journal;
}

tl::expected<void, v1::Error> SceneMaker::startRecording(v1::StartRecordingRequest request,
                                                         StartRecordingDone done) {
  return enqueue(
      "startRecording", [this, request = std::move(request)] { return startNow(request); }, std::move(done));
}

tl::expected<void, v1::Error> SceneMaker::stopRecording(v1::StopRecordingRequest request,
                                                        StopRecordingDone done) {
  return enqueue(
      "stopRecording", [this, request = std::move(request)] { return stopNow(request); }, std::move(done));
}

tl::expected<v1::StartRecordingResponse, v1::Error> SceneMaker::startNow(
    const v1::StartRecordingRequest& request) const {
  const auto journal = journalOf("startRecording", request.scene());
  if (!journal) return tl::unexpected(journal.error());
  auto file = (*journal)->start(request.name());
  if (!file && file.error().limit) metrics_.refuse(*file.error().limit);
  if (!file) return refusal(file.error().code, std::move(file.error().text));
  v1::StartRecordingResponse response;
  response.set_file(std::move(*file));
  return response;
}

tl::expected<v1::StopRecordingResponse, v1::Error> SceneMaker::stopNow(
    const v1::StopRecordingRequest& request) const {
  const auto journal = journalOf("stopRecording", request.scene());
  if (!journal) return tl::unexpected(journal.error());
  auto stopped = (*journal)->stop();
  if (!stopped) return refusal(stopped.error().code, std::move(stopped.error().text));
  return std::move(*stopped);
}

tl::expected<model::Scene, v1::Error> SceneMaker::checked(messages::Result<model::Scene> scene) {
  if (scene) return std::move(*scene);
  if (scene.error().limit) metrics_.refuse(*scene.error().limit);
  return refusal(scene.error().code, "createScene.scene: " + scene.error().text);
}

tl::expected<model::Scene, v1::Error> SceneMaker::definitionOf(const v1::CreateSceneRequest& request,
                                                               const std::string& uploaded,
                                                               const model::Cancellation& cancellation,
                                                               std::vector<v1::MeshRepair>& repairs) {
  const messages::SceneLimits limits{.nodes = options_.maxSceneNodes,
                                     .nodeSprings = options_.maxNodeSprings,
                                     .springs = options_.maxSceneSprings,
                                     .attachments = options_.maxSceneAttachments,
                                     .cancellation = cancellation};
  switch (request.source_case()) {
    case v1::CreateSceneRequest::kScene:
      return checked(messages::toScene(request.scene(), {}, limits, &repairs));
    case v1::CreateSceneRequest::kUploadedContentId: {
      v1::Scene message;
      const std::size_t most = options_.maxParsedBytes;
      const auto size =
          messages::parsedSize(*v1::Scene::descriptor(), std::as_bytes(std::span(uploaded)), most);
      if (!size && size.error() == messages::SizeError::tooLarge) {
        metrics_.refuse(telemetry::Refusal::sceneSize);
        return refusal(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                       fmt::format("createScene: the uploaded Scene message would take more than {} bytes of "
                                   "memory (--profile): send fewer elements",
                                   most));
      }
      cancellation.check();
      if (!size || !message.ParseFromString(uploaded))
        return refusal(v1::ERROR_CODE_MALFORMED_MESSAGE,
                       "createScene: the uploaded content is not a Scene message");
      cancellation.check();
      return checked(messages::toScene(message, {}, limits, &repairs));
    }
    case v1::CreateSceneRequest::kNamed:
      if (const std::shared_ptr<scene::LiveScene> live = scenes_.find(request.named())) return live->start();
      if (std::ranges::count(messages::namedScenes(), request.named()) > 0)
        return checked(messages::loadScene(request.named()));
      return tl::unexpected(scenes_.noSuchScene(request.named(), identity::local()));
    default:
      return refusal(v1::ERROR_CODE_INVALID_ARGUMENT,
                     "createScene: must have one of \"scene\", \"uploadedContentId\" and \"named\"");
  }
}

tl::expected<v1::CreateSceneResponse, v1::Error> SceneMaker::createNow(
    const v1::CreateSceneRequest& request, const std::string& uploaded, const std::string& tenant,
    const model::Cancellation& cancellation) {
  std::vector<v1::MeshRepair> repairs;
  auto definition = definitionOf(request, uploaded, cancellation, repairs);
  if (!definition) return tl::unexpected(std::move(definition).error());
  if (!request.name().empty()) {
    messages::Checks checks;
    definition->name = checks.name(messages::Path("createScene.name"), request.name());
    if (auto named = std::move(checks).result(true); !named)
      return refusal(named.error().code, named.error().text);
  }
  const std::uint32_t most = options_.maxParticipants;
  if (request.max_participants() > most)
    return refusal(v1::ERROR_CODE_INVALID_ARGUMENT,
                   fmt::format("createScene.maxParticipants = {}: must be at most {}, the server's maximum",
                               request.max_participants(), most));
  const auto scene = created_.create(std::move(*definition),
                                     request.max_participants() > 0 ? request.max_participants() : most,
                                     tenant, cancellation);
  if (!scene) return tl::unexpected(scene.error());
  kept_.flush(**scene);
  telemetry::log({(*scene)->name()}, spdlog::level::info, "created, {} vertices",
                 (*scene)->start().nodeCount());
  v1::CreateSceneResponse response;
  *response.mutable_scene() = summaryOf(**scene);
  response.mutable_repairs()->Assign(repairs.begin(), repairs.end());
  return response;
}

tl::expected<v1::DeleteSceneResponse, v1::Error> SceneMaker::removeNow(const v1::DeleteSceneRequest& request,
                                                                       const std::string& why) {
  const std::shared_ptr<scene::LiveScene> scene =
      request.name().empty() ? nullptr : scenes_.find(request.name());
  if (!scene) return tl::unexpected(SceneRegistry::noSuchScene(request.name()));
  if (!scene->terms.created)
    return refusal(
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("deleteScene.name = \"{}\": must be of a scene that was created; the server started "
                    "with this one",
                    request.name()));
  const delivery::SharedBytes last =
      delivery::notice(v1::NOTICE_KIND_SCENE_DELETED, fmt::format("the scene '{}' {}", scene->name(), why),
                       scene->tick.load());
  // No later request finds the scene, so its deletion must be completed here.
  created_.remove(scene, last);
  kept_.flush(*scene);
  telemetry::log({scene->name()}, spdlog::level::info, "deleted");
  return v1::DeleteSceneResponse();
}

}  // namespace clothstream::hosting
