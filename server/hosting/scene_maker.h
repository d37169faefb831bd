// SPDX-License-Identifier: MIT
// Creates and deletes scenes, and starts and stops recordings, while the server runs.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/hosting/created_scenes.h"
#include "server/hosting/kept_scenes.h"
#include "server/hosting/scene_registry.h"
#include "server/hosting/server_options.h"
#include "server/hosting/upload_budget.h"
#include "server/messages/field_error.h"
#include "server/model/cancellation.h"
#include "server/model/scene.h"
#include "server/scene/journal.h"
#include "server/telemetry/metrics.h"

namespace clothstream::hosting {

// Returns whether the peer still waits for the answer. Called on any thread; must not block.
using Wanted = std::function<bool()>;
// Called once, on any thread. Must not block.
using CreateDone = std::function<void(tl::expected<v1::CreateSceneResponse, v1::Error>)>;
using StartRecordingDone = std::function<void(tl::expected<v1::StartRecordingResponse, v1::Error>)>;
using StopRecordingDone = std::function<void(tl::expected<v1::StopRecordingResponse, v1::Error>)>;
using DeleteDone = std::function<void(tl::expected<v1::DeleteSceneResponse, v1::Error>)>;

// Thread-safe. Does one request at a time, on a worker thread, which also calls each `done`: checking a large
// mesh and loading a scene take seconds. The caller has checked that the peer may do what it asks for.
class SceneMaker {
 public:
  // The arguments must outlive this.
  SceneMaker(const ServerOptions& options, telemetry::ServerMetrics& metrics, const SceneRegistry& scenes,
             const KeptScenes& kept, CreatedScenes& created);
  // Cancels the scene that is being created, and refuses those that wait. Finishes all other requests.
  ~SceneMaker();
  SceneMaker(const SceneMaker&) = delete;
  SceneMaker& operator=(const SceneMaker&) = delete;

  // Cancels the scene that is being created, and refuses those that wait and come.
  void stop() { stopping_ = true; }

  // Maximum number of scenes that wait to be created, and also of other requests that wait.
  static constexpr std::uint32_t kMaxWaiting = 64;

  // `uploaded` is the content that `request` names, if it names one. Its reservation ends before the answer.
  // `tenant` is that of the peer; empty if it has none.
  // While kMaxWaiting scenes wait it returns an error, and `done` is not called. Creating a scene ends early
  // when the peer does not want it any more, after Limits::maxCreationTime, and when the server stops.
  [[nodiscard]] tl::expected<void, v1::Error> create(v1::CreateSceneRequest request,
                                                     std::optional<UploadedContent> uploaded,
                                                     std::string tenant, Wanted wanted, CreateDone done);
  // While kMaxWaiting of the following requests wait, they return an error, and `done` is not called.
  [[nodiscard]] tl::expected<void, v1::Error> remove(v1::DeleteSceneRequest request, DeleteDone done);
  // Both block the worker thread on the disk.
  [[nodiscard]] tl::expected<void, v1::Error> startRecording(v1::StartRecordingRequest request,
                                                             StartRecordingDone done);
  [[nodiscard]] tl::expected<void, v1::Error> stopRecording(v1::StopRecordingRequest request,
                                                            StopRecordingDone done);

 private:
  // Gives the result of `work` to `done`, on the worker thread.
  template <class Work, class Done>
  tl::expected<void, v1::Error> enqueue(const char* call, Work work, Done done);
  tl::expected<v1::CreateSceneResponse, v1::Error> createNow(const v1::CreateSceneRequest& request,
                                                             const std::string& uploaded,
                                                             const std::string& tenant,
                                                             const model::Cancellation& cancellation);
  tl::expected<model::Scene, v1::Error> definitionOf(const v1::CreateSceneRequest& request,
                                                     const std::string& uploaded,
                                                     const model::Cancellation& cancellation,
                                                     std::vector<v1::MeshRepair>& repairs);
  tl::expected<model::Scene, v1::Error> checked(messages::Result<model::Scene> scene);
  tl::expected<std::shared_ptr<scene::Journal>, v1::Error> journalOf(const std::string& call,
                                                                     const std::string& scene) const;
  // The scene's participants get a notice: "the scene 'name' " and then `why`.
  tl::expected<v1::DeleteSceneResponse, v1::Error> removeNow(const v1::DeleteSceneRequest& request,
                                                             const std::string& why);
  tl::expected<v1::StartRecordingResponse, v1::Error> startNow(
      const v1::StartRecordingRequest& request) const;
  tl::expected<v1::StopRecordingResponse, v1::Error> stopNow(const v1::StopRecordingRequest& request) const;

  // Deletes unused created scenes at intervals.
  void expireLater();
  void deleteUnused(std::chrono::milliseconds lifetime);

  const ServerOptions& options_;
  telemetry::ServerMetrics& metrics_;
  const SceneRegistry& scenes_;
  const KeptScenes& kept_;
  CreatedScenes& created_;
  std::atomic<bool> stopping_ = false;
  std::atomic<std::uint32_t> waiting_ = 0;   // scenes to be created
  std::atomic<std::uint32_t> requests_ = 0;  // other requests that wait
  boost::asio::thread_pool thread_{1};
  boost::asio::steady_timer expiry_{thread_};
  bool ended_ = false;  // belongs to the thread, like expiry_
};

}  // namespace clothstream::hosting
