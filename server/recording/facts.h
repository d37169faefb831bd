// SPDX-License-Identifier: MIT
// What a recording was made on and with.
#pragma once

#include <string>

#include "clothstream/v1/session.pb.h"
#include "proto/recording/mcap_format.h"
#include "server/model/scene.h"
#include "server/vulkan/device.h"

namespace clothstream::recording {

// Names as in docs/recording.md.
Facts factsOf(const std::string& serverName, const vulkan::DeviceInfo& device, const model::Scene& scene,
              const v1::StreamDescription& description);

// Of this machine's processor, those that software devices choose their code by; space-separated.
std::string processorFeatures();

// Of all kernels' sources that this program was built from.
std::string shaderHash();

}  // namespace clothstream::recording
