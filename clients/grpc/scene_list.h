// SPDX-License-Identifier: MIT
// Lists the scenes of a server without joining one.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/native/address.h"
#include "clients/native/failure.h"

namespace clothstream {

struct SceneSummary {
  std::string name, description;
  std::uint32_t vertexCount = 0, clothCount = 0, participants = 0, maxParticipants = 0;
  bool running = false, paused = false, created = false;
};

// `address` must come from completeAddress().
[[nodiscard]] tl::expected<std::vector<SceneSummary>, Failure> listScenes(
    const ServerAddress& address, std::chrono::milliseconds timeout = std::chrono::milliseconds(10'000));

}  // namespace clothstream
