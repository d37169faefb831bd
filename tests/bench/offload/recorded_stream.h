// SPDX-License-Identifier: MIT
// What the server sends to one client of a scene.
#pragma once

#include <cstdint>
#include <vector>

#include "server/delivery/envelope.h"
#include "server/model/scene.h"
#include "server/vulkan/device.h"

namespace clothstream::bench::offload {

struct RecordedStream {
  std::vector<delivery::SharedBytes> before;  // Welcome and description
  std::vector<delivery::SharedBytes> frames;  // with the announcements between them
  std::vector<std::uint64_t> stateHashes;     // after each tick
};

// Runs the scene for `ticks` ticks through the server's own stages (scene host, encoder, publisher, mailbox),
// without network and as fast as the device can. The server's clock starts at one second and advances by one
// tick at a time. The client acknowledges every frame at once. Throws std::runtime_error if a frame is
// missing.
RecordedStream recordStream(vulkan::Device& device, const model::Scene& scene, std::uint32_t ticks);

}  // namespace clothstream::bench::offload
