// SPDX-License-Identifier: MIT
// Offers the scenes of this server to edge servers, and sends them frames and events over NATS.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "server/fleet/nats.h"
#include "server/hosting/scene_server.h"

namespace clothstream::fleet {

// Each frame and event of a scene is sent once, whatever the number of edges, and only while an edge needs
// it.
//
// Offered are the default scene, scenes from files, created scenes and a recording that is played, but
// neither the other built-in scenes, which every server has, nor recordings in lockstep.
class Origin {
 public:
  // The server must outlive it.
  Origin(hosting::SceneServer& server, const NatsOptions& options);
  // Tells the edges that the scenes have ended.
  ~Origin();
  Origin(const Origin&) = delete;
  Origin& operator=(const Origin&) = delete;

 private:
  struct Stream;

  void run();
  // Begins and ends streams, as scenes are created and deleted.
  void lookForScenes();
  void offer();

  hosting::SceneServer& server_;
  const std::uint64_t id_;
  Nats nats_;
  std::map<std::string, std::unique_ptr<Stream>> streams_;  // by name of the scene; used by the thread

  std::mutex mutex_;  // protects `stopping_`
  std::condition_variable changed_;
  bool stopping_ = false;

  std::thread thread_;
};

}  // namespace clothstream::fleet
