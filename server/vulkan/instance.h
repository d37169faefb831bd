// SPDX-License-Identifier: MIT
// Loader, instance, validation and the choice of a device. Only for this folder.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <vulkan/vulkan_raii.hpp>

#include "server/vulkan/device.h"

namespace clothstream::vulkan {

// True if the environment variable CLOTHSTREAM_VALIDATION asks for validation (anything but empty and 0).
bool validationByEnvironment();

// Keeps the number of threads of software devices in the environment during its lifetime. Mesa reads it when
// devices are listed. The number is the given one, else the value of the environment, else the default. The
// environment belongs to the whole process: no other thread may read it meanwhile.
class SoftwareThreads {
 public:
  explicit SoftwareThreads(std::optional<std::uint32_t> threads);
  ~SoftwareThreads();
  SoftwareThreads(const SoftwareThreads&) = delete;
  SoftwareThreads& operator=(const SoftwareThreads&) = delete;

  // Threads that run kernels at the same time, at least 1.
  std::uint32_t count() const;

 private:
  std::optional<std::string> before_;
};

// Throws DeviceError if the loader is not installed.
vk::raii::Context openLoader();

// Creates a Vulkan 1.2 instance, with the validation layer if `validate`. Throws DeviceError if there is no
// driver or no layer.
vk::raii::Instance makeInstance(const vk::raii::Context& context, bool validate);

// Counts and logs the messages of the validation layer during its lifetime.
vk::raii::DebugUtilsMessengerEXT makeMessenger(const vk::raii::Instance& instance);

struct Candidate {
  DeviceInfo info;
  vk::raii::PhysicalDevice physical;
  std::uint32_t queueFamily = 0;  // a family with compute queues
};

// Sorts devices, best first (discrete, integrated, virtual, software, other; the loader's order among
// equals), and numbers them in that order.
void rank(std::vector<Candidate>& candidates);

// Returns the usable devices (Vulkan 1.2, timeline semaphores, compute), sorted by rank(). Throws DeviceError
// if no device is usable.
std::vector<Candidate> candidates(const vk::raii::Instance& instance);

// Returns the index that DeviceOptions::select means. Throws DeviceError, which lists the devices.
std::size_t select(const std::vector<Candidate>& candidates, std::string_view wanted);

}  // namespace clothstream::vulkan
