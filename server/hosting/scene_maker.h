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

#include "server/hosting/scene_server.h"
#include "server/hosting/upload_budget.h"
#include "server/messages/field_error.h"
#include "server/model/cancellation.h"

namespace clothstream::scene {
class LiveScene;
}

namespace clothstream::hosting {

// Thread-safe. Does one request at a time, on a worker thread, which also calls each `done`: checking a large
// mesh and loading a scene take seconds. The caller has checked that the peer may do what it asks for.
class SceneMaker {
 public:
  explicit SceneMaker(SceneServer::State& server);
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
  // Removes a scene that cannot be used, because its creation was cancelled or has failed.
  void undoCreation(const std::shared_ptr<scene::LiveScene>& scene);
  // The scene's participants get a notice: "the scene 'name' " and then `why`.
  tl::expected<v1::DeleteSceneResponse, v1::Error> removeNow(const v1::DeleteSceneRequest& request,
                                                             const std::string& why);
  tl::expected<v1::StartRecordingResponse, v1::Error> startNow(
      const v1::StartRecordingRequest& request) const;
  tl::expected<v1::StopRecordingResponse, v1::Error> stopNow(const v1::StopRecordingRequest& request) const;

  // Deletes unused created scenes at intervals.
  void expireLater();
  void deleteUnused(std::chrono::milliseconds lifetime);

  SceneServer::State& server_;
  std::atomic<bool> stopping_ = false;
  std::atomic<std::uint32_t> waiting_ = 0;   // scenes to be created
  std::atomic<std::uint32_t> requests_ = 0;  // other requests that wait
  boost::asio::thread_pool thread_{1};
  boost::asio::steady_timer expiry_{thread_};
  bool ended_ = false;  // belongs to the thread, like expiry_
};

}  // namespace clothstream::hosting
