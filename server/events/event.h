// SPDX-License-Identifier: MIT
// Events that a backend gets, and their JSON.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <variant>

#include "server/scene/roles.h"
#include "server/scene/subject.h"

namespace clothstream::events {

struct Joined {
  std::uint64_t participant = 0;
  scene::Role role = scene::Role::none;
  scene::Subject subject;
};

struct Left {
  std::uint64_t participant = 0;
  scene::Role role = scene::Role::none;  // when it left
  scene::Subject subject;
  double connectedSeconds = 0;
};

// What a scene has used since its last event of this kind.
struct Usage {
  double deviceSeconds = 0;
  std::uint64_t sentBytes = 0;
};

struct Event {
  std::chrono::system_clock::time_point time;
  std::string scene, tenant;  // the tenant is the scene's; empty if it has none
  std::variant<Joined, Left, Usage> what;
};

// `server` is the name of this server.
std::string toJson(const Event& event, const std::string& server);

}  // namespace clothstream::events
