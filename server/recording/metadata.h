// SPDX-License-Identifier: MIT
// Metadata of a recording: server, device, processor, kernels and scene.
#pragma once

#include <string>

#include "clothstream/v1/session.pb.h"
#include "proto/recording/mcap_format.h"
#include "server/model/scene.h"
#include "server/vulkan/device.h"

namespace clothstream::recording {

// docs/recording.md lists the names.
Metadata metadataOf(const std::string& serverName, const vulkan::DeviceInfo& device,
                    const model::Scene& scene, const v1::StreamDescription& description);

// Hash of the compiled kernels of this program.
std::string shaderHash();

// Processor features of this machine that software Vulkan devices depend on, separated by spaces.
std::string processorFeatures();

}  // namespace clothstream::recording
