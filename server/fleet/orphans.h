// SPDX-License-Identifier: MIT
// Scenes whose server is gone, until another server continues them.
#pragma once

#include <functional>
#include <map>
#include <random>
#include <string>

#include "server/schedule/clock.h"

namespace clothstream::fleet {

// Servers try to adopt a scene at different times, each after a random part of half a second. Not
// thread-safe.
class Orphans {
 public:
  using Clock = schedule::Clock;

  // A scene that is there already keeps its times.
  void add(const std::string& scene, Clock::time_point now);
  void erase(const std::string& scene) { orphans_.erase(scene); }
  void eraseIf(const std::function<bool(const std::string& scene)>& isGone);
  // After an attempt that failed. The scene must be there.
  void postpone(const std::string& scene, Clock::time_point until) { orphans_.at(scene).adoptAt = until; }

  // Whether this server may try to adopt the scene.
  bool isDue(const std::string& scene, Clock::time_point now) const;
  // Whether a server may still continue the scene, so that its name is not free. True for one that is not
  // there yet.
  bool mayContinue(const std::string& scene, Clock::time_point now) const;

 private:
  struct Orphan {
    Clock::time_point since, adoptAt;
  };

  std::map<std::string, Orphan> orphans_;
  std::minstd_rand random_{std::random_device{}()};
};

}  // namespace clothstream::fleet
