// SPDX-License-Identifier: MIT
// The way to the driver: loader, instance, validation, and which device is meant. For this room alone.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <vulkan/vulkan_raii.hpp>

#include "server/vulkan/device.h"

namespace clothstream::vulkan {

// Whether CLOTHSTREAM_VALIDATION in the environment asks for validation (anything but empty and 0).
bool validationByEnvironment();

// While it lives, the number of threads of software devices is in the environment, where Mesa reads it as
// devices are listed: the given one, else what is there already, else the default. The environment belongs to
// the whole process: no other thread may read it meanwhile.
class SoftwareThreads {
 public:
  explicit SoftwareThreads(std::optional<std::uint32_t> threads);
  ~SoftwareThreads();
  SoftwareThreads(const SoftwareThreads&) = delete;
  SoftwareThreads& operator=(const SoftwareThreads&) = delete;

 private:
  std::optional<std::string> before_;
};

// Throws DeviceError where the loader is not installed.
vk::raii::Context openLoader();

// Vulkan 1.2, with the validation layer where `validate`. Throws DeviceError where there is no driver or no
// layer.
vk::raii::Instance makeInstance(const vk::raii::Context& context, bool validate);

// Counts and logs what the validation layer says, for as long as it lives.
vk::raii::DebugUtilsMessengerEXT makeMessenger(const vk::raii::Instance& instance);

struct Candidate {
  DeviceInfo info;
  vk::raii::PhysicalDevice physical;
  std::uint32_t queueFamily = 0;  // one that computes
};

// Best first (discrete, integrated, virtual, software, other; the loader's order among equals), and numbers
// them so.
void rank(std::vector<Candidate>& candidates);

// The devices that can serve (Vulkan 1.2, timeline semaphores, compute), ranked. Throws DeviceError if none
// can.
std::vector<Candidate> candidates(const vk::raii::Instance& instance);

// The one that DeviceOptions::select means. Throws DeviceError that lists what there is.
std::size_t select(const std::vector<Candidate>& candidates, std::string_view wanted);

}  // namespace clothstream::vulkan
