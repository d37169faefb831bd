// SPDX-License-Identifier: MIT
// Collects the metadata of a recording.
#include "server/recording/metadata.h"

#include <cstdlib>
#include <ctime>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "kernels/shader_hash.h"
#include "proto/recording/verdict.h"

namespace clothstream::recording {
namespace {

// Value of an environment variable that changes the code of software Vulkan devices.
std::string setting(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "default" : value;
}

}  // namespace

std::string shaderHash() {
  return kernels::kShaderHash;
}

std::string processorFeatures() {
#if defined(__x86_64__)
  std::string features = "x86-64";
  const auto add = [&](const char* name, int has) {
    if (has != 0) features += std::string(" ") + name;
  };
  add("sse4.2", __builtin_cpu_supports("sse4.2"));
  add("avx", __builtin_cpu_supports("avx"));
  add("avx2", __builtin_cpu_supports("avx2"));
  add("fma", __builtin_cpu_supports("fma"));
  add("avx512f", __builtin_cpu_supports("avx512f"));
  return features;
#elif defined(__aarch64__)
  return "aarch64";
#else
  return "other";
#endif
}

Metadata metadataOf(const std::string& serverName, const vulkan::DeviceInfo& device,
                    const model::Scene& scene, const v1::StreamDescription& description) {
  return {{"server", serverName},
          {"scene", scene.name},
          {"started", fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr)))},
          {"device", device.name},
          {"driver", device.driver},
          {"vulkan", device.apiVersion},
          {"processor", processorFeatures()},
          {"software_vector_bits", setting("LP_NATIVE_VECTOR_WIDTH")},
          {kKernelsEntry, shaderHash()},
          {"codec", fmt::format("{}", description.codec())},
          {"max_error", fmt::format("{}", description.max_error())},
          {"vertices", fmt::format("{}", scene.nodeCount())},
          {"simulation_rate", fmt::format("{}", scene.simulationRate)},
          {"stream_rate", fmt::format("{}", scene.streamRate)}};
}

}  // namespace clothstream::recording
