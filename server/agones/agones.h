// SPDX-License-Identifier: MIT
// A server as a game server of Agones, which places scenes on servers.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "server/agones/sidecar.h"
#include "server/hosting/scene_server.h"
#include "server/schedule/clock.h"

namespace clothstream::agones {

// Names of counters and of the list in the GameServer's specification. Those that it does not have are left
// out.
inline constexpr const char* kParticipants = "participants";  // connected ones; capacity: room in all scenes
inline constexpr const char* kCreatedScenes = "created-scenes";
inline constexpr const char* kLoad =
    "load";  // price of what clients added, ms of the device's time per second
inline constexpr const char* kScenes = "scenes";  // list of the names of all scenes

// Tells the sidecar that the server is ready, every two seconds that it is healthy, and once per second what
// has changed of counters and list. While the server has participants or scenes that clients created, it is
// allocated, so that Agones does not end it; 30 seconds after the last of them it is ready again. So it is if
// a backend has allocated it and no client comes for 30 seconds.
//
// Another thread makes the calls. A sidecar that does not answer is asked again.
class Agones {
 public:
  static constexpr std::chrono::seconds kPeriod{1}, kHealthPeriod{2}, kStaysAllocated{30};

  // The server must outlive it. `deviceSilence`: the server counts as healthy if its device thread has
  // answered within this time.
  Agones(hosting::SceneServer& server, std::uint16_t port,
         schedule::Clock::duration deviceSilence = std::chrono::seconds(5));
  // Asks Agones to end the pod.
  ~Agones();
  Agones(const Agones&) = delete;
  Agones& operator=(const Agones&) = delete;

 private:
  using Clock = schedule::Clock;
  struct Count {
    std::int64_t count = 0, capacity = 0;
    bool operator==(const Count&) const = default;
  };

  void run();
  void look(Clock::time_point now);
  // Makes the server ready or allocated, or sees that a backend has allocated it.
  void choosePhase(bool inUse, Clock::time_point now);
  bool wasAllocated();
  void tellCounts(const std::map<std::string, Count>& counts);
  void tellScenes(const std::set<std::string>& names);
  // Returns whether the call succeeded. Logs the first failure of a row.
  bool done(const char* what, Sidecar::Answer answer);
  // Remembers a counter or list that the GameServer does not have, and returns whether it is that.
  bool isUnknown(const std::string& name, Sidecar::Answer answer);

  hosting::SceneServer& server_;
  const Clock::duration deviceSilence_;
  Sidecar sidecar_;

  // Used by the thread.
  enum class Phase : std::uint8_t { starting, ready, allocated };
  Phase phase_ = Phase::starting;
  Clock::time_point lastInUse_{}, nextHealth_{};
  std::map<std::string, Count> told_;
  std::set<std::string> scenesTold_, unknown_;
  bool scenesKnown_ = false;  // the list's values at the start were read
  bool failing_ = false;

  std::mutex mutex_;  // protects `stopping_`
  std::condition_variable changed_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace clothstream::agones
