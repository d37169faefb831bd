// SPDX-License-Identifier: MIT
// Scenes that come and go while the server runs.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include <boost/asio/thread_pool.hpp>
#include <tl/expected.hpp>

#include "server/stream/scene_server.h"
#include "server/stream/upload.h"

namespace clothstream::stream {

// One after the other, on a thread of its own: checking a large mesh takes seconds, and so does making a
// scene ready. Thread-safe.
class SceneMaker {
 public:
  explicit SceneMaker(SceneServer::State& server) : server_(server), thread_(1) {}
  // What was asked for is done first.
  ~SceneMaker() { thread_.join(); }
  SceneMaker(const SceneMaker&) = delete;
  SceneMaker& operator=(const SceneMaker&) = delete;

  // How many may wait to be created.
  static constexpr std::uint32_t kMostWaiting = 64;

  // `uploaded`: what `request` names as uploaded, if it does; its room is taken until it is answered.
  void create(v1::CreateSceneRequest request, std::optional<UploadedContent> uploaded, CreateDone done);
  void remove(v1::DeleteSceneRequest request, DeleteDone done);
  // Both wait for the disk.
  void startRecording(v1::StartRecordingRequest request, StartRecordingDone done);
  void stopRecording(v1::StopRecordingRequest request, StopRecordingDone done);

 private:
  tl::expected<v1::CreateSceneResponse, v1::Error> make(const v1::CreateSceneRequest& request,
                                                        const std::string& uploaded);
  tl::expected<model::Scene, v1::Error> definitionOf(const v1::CreateSceneRequest& request,
                                                     const std::string& uploaded) const;
  // The journal of the scene. All that is asked of recordings goes through here: who may ask is to be checked
  // in it.
  tl::expected<std::shared_ptr<Journal>, v1::Error> journalOf(const std::string& scene) const;
  tl::expected<v1::DeleteSceneResponse, v1::Error> removeNow(const v1::DeleteSceneRequest& request);
  tl::expected<v1::StartRecordingResponse, v1::Error> startNow(
      const v1::StartRecordingRequest& request) const;
  tl::expected<v1::StopRecordingResponse, v1::Error> stopNow(const v1::StopRecordingRequest& request) const;

  SceneServer::State& server_;
  std::atomic<std::uint32_t> waiting_ = 0;  // to be created
  boost::asio::thread_pool thread_;
};

}  // namespace clothstream::stream
