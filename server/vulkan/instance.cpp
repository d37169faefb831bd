// SPDX-License-Identifier: MIT
// Loader, instance, validation and the choice of a device. Only for this folder.
#include "server/vulkan/instance.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

namespace clothstream::vulkan {
namespace {

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";
constexpr std::uint32_t kApiVersion = VK_API_VERSION_1_2;

constexpr std::string_view kInstallDriver =
    "Install a driver: Debian's mesa-vulkan-drivers has the software device and drives AMD and Intel GPUs; "
    "for "
    "NVIDIA install nvidia-driver and nvidia-vulkan-icd. `vulkaninfo --summary` (vulkan-tools) shows what is "
    "found.";

// Messages of the validation layer in this process. They come from every thread that calls Vulkan.
struct Messages {
  static constexpr std::size_t kKept = 16;
  std::atomic<std::uint64_t> count = 0;
  std::mutex mutex;
  std::deque<std::string> newest;
};

Messages& messages() {
  static Messages instance;
  return instance;
}

// `id` is that of the rule, such as SYNC-HAZARD-READ-AFTER-WRITE. Old layers repeat it in the message.
void onMessage(std::string_view id, std::string_view message) {
  const std::string text =
      message.find(id) == std::string_view::npos ? fmt::format("{}: {}", id, message) : std::string(message);
  Messages& all = messages();
  {
    const std::lock_guard lock(all.mutex);
    if (all.newest.size() == Messages::kKept) all.newest.pop_front();
    all.newest.emplace_back(text);
  }
  ++all.count;
  spdlog::error("Vulkan validation: {}", text);
}

vk::DebugUtilsMessengerCreateInfoEXT messengerInfo() {
  using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
  return {.messageSeverity = Severity::eWarning | Severity::eError,
          .messageType = vk::DebugUtilsMessageTypeFlagBitsEXT::eValidation,
          // Vulkan's headers declare the callback with types of C before 1.4.304, and of C++ since then.
          .pfnUserCallback = [](auto, auto, const auto* data, void*) -> VkBool32 {
            onMessage(data->pMessageIdName == nullptr ? "" : data->pMessageIdName, data->pMessage);
            return VK_FALSE;
          }};
}

// One for each processor this process may use. Measured: ms from submission to completion of ten dependent
// dispatches that gather 12 neighbours per node (lavapipe of Mesa 22.3.6, two processors, others using less
// than 0.12 of one; median of at least six medians):
//   threads     0 (inline)   1      2      3
//   32 x 32       0.52      1.4    1.2    0.85
//   64 x 64       1.8       3.0    2.2    1.7
//   128 x 128     6.8       7.7    5.9    4.9
//   256 x 256    32        29     15.5   18.5
// Handing a dispatch to threads costs a small cloth a millisecond of its tick at most; a large one needs them
// all. One thread only adds the hand-over, so that a single processor works inline.
std::uint32_t defaultSoftwareThreads() {
  const std::uint32_t processors = std::thread::hardware_concurrency();
  return processors > 1 ? processors : 0;
}

DeviceKind kindOf(vk::PhysicalDeviceType type) {
  switch (type) {
    case vk::PhysicalDeviceType::eDiscreteGpu:
      return DeviceKind::discrete;
    case vk::PhysicalDeviceType::eIntegratedGpu:
      return DeviceKind::integrated;
    case vk::PhysicalDeviceType::eVirtualGpu:
      return DeviceKind::virtualGpu;
    case vk::PhysicalDeviceType::eCpu:
      return DeviceKind::software;
    default:
      return DeviceKind::other;
  }
}

std::string versionText(std::uint32_t version) {
  return fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version),
                     VK_API_VERSION_PATCH(version));
}

std::optional<std::uint32_t> computeQueueFamily(const vk::raii::PhysicalDevice& physical) {
  const auto families = physical.getQueueFamilyProperties();
  for (std::uint32_t i = 0; i < families.size(); ++i)
    if (families[i].queueFlags & vk::QueueFlagBits::eCompute) return i;
  return std::nullopt;
}

std::string lowerCase(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

std::string listText(const std::vector<Candidate>& candidates) {
  std::string text;
  for (const Candidate& candidate : candidates)
    text += fmt::format("\n  {}: {} ({})", candidate.info.index, candidate.info.name, candidate.info.driver);
  return text;
}

constexpr const char* kSoftwareThreads = "LP_NUM_THREADS";

// Keeps the drivers loaded until the process ends. The loader otherwise unloads them with the last instance,
// and a process that had opened an NVIDIA H200 about thirty times (driver 580.159.04) could not load its
// driver again. The instance has no layers, and its devices are never enumerated, so that it costs little.
void keepDriversLoaded() {
  struct Kept {
    vk::raii::Context context;
    vk::raii::Instance instance;
  };
  static std::mutex mutex;
  static const Kept* kept = nullptr;  // never deleted: drivers may not survive calls at the process's end
  const std::lock_guard lock(mutex);
  if (kept != nullptr) return;
  const vk::ApplicationInfo application{.pApplicationName = "clothstream", .apiVersion = kApiVersion};
  vk::raii::Context context;
  vk::raii::Instance instance(context, vk::InstanceCreateInfo{.pApplicationInfo = &application});
  kept = new Kept{std::move(context), std::move(instance)};
}

}  // namespace

bool validationByEnvironment() {
  const char* value = std::getenv("CLOTHSTREAM_VALIDATION");
  return value != nullptr && *value != '\0' && std::string_view(value) != "0";
}

SoftwareThreads::SoftwareThreads(std::optional<std::uint32_t> threads) {
  if (const char* given = std::getenv(kSoftwareThreads)) before_ = given;
  const std::string number = std::to_string(threads.value_or(defaultSoftwareThreads()));
  setenv(kSoftwareThreads, number.c_str(), threads.has_value() ? 1 : 0);
}

std::uint32_t SoftwareThreads::count() const {
  // More threads than Mesa's own limit do not run.
  constexpr unsigned long kMostThreads = 32;
  const char* number = std::getenv(kSoftwareThreads);
  const unsigned long threads = number != nullptr ? std::strtoul(number, nullptr, 10) : 0;
  return static_cast<std::uint32_t>(std::clamp(threads, 1ul, kMostThreads));
}

SoftwareThreads::~SoftwareThreads() {
  if (before_)
    setenv(kSoftwareThreads, before_->c_str(), 1);
  else
    unsetenv(kSoftwareThreads);
}

vk::raii::Context openLoader() {
  try {
    return {};
  } catch (const std::runtime_error& error) {
    throw DeviceError(
        fmt::format("the Vulkan loader libvulkan.so.1 cannot be opened ({}). Install Debian's libvulkan1. {}",
                    error.what(), kInstallDriver));
  }
}

vk::raii::Instance makeInstance(const vk::raii::Context& context, bool validate) {
  const vk::ApplicationInfo application{.pApplicationName = "clothstream", .apiVersion = kApiVersion};
  const vk::ValidationFeatureEnableEXT feature = vk::ValidationFeatureEnableEXT::eSynchronizationValidation;
  const vk::DebugUtilsMessengerCreateInfoEXT messenger = messengerInfo();
  const vk::ValidationFeaturesEXT features{
      .pNext = &messenger, .enabledValidationFeatureCount = 1, .pEnabledValidationFeatures = &feature};
  const char* extension = VK_EXT_DEBUG_UTILS_EXTENSION_NAME;
  vk::InstanceCreateInfo info{.pApplicationInfo = &application};
  if (validate) {
    // Only this environment setting makes the layer find hazards between submissions.
    setenv("VK_LAYER_ENABLES",
           "VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT:"
           "VALIDATION_CHECK_ENABLE_SYNCHRONIZATION_VALIDATION_QUEUE_SUBMIT",
           0);
    // And newer layers, such as that of Debian 13, look at what shaders read and write only with this one.
    setenv("VK_LAYER_SYNCVAL_SHADER_ACCESSES_HEURISTIC", "true", 0);
    info.pNext = &features;
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = &kValidationLayer;
    info.enabledExtensionCount = 1;
    info.ppEnabledExtensionNames = &extension;
  }
  try {
    vk::raii::Instance instance(context, info);
    keepDriversLoaded();
    return instance;
  } catch (const vk::LayerNotPresentError&) {
    throw DeviceError(
        fmt::format("validation was asked for (option or CLOTHSTREAM_VALIDATION), but {} is not installed. "
                    "Install Debian's "
                    "vulkan-validationlayers.",
                    kValidationLayer));
  } catch (const vk::IncompatibleDriverError&) {
    throw DeviceError(fmt::format("no Vulkan driver was found. {}", kInstallDriver));
  } catch (const vk::SystemError& error) {
    throw DeviceError(fmt::format("vkCreateInstance failed: {}", error.what()));
  }
}

vk::raii::DebugUtilsMessengerEXT makeMessenger(const vk::raii::Instance& instance) {
  return {instance, messengerInfo()};
}

void rank(std::vector<Candidate>& candidates) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.info.kind < b.info.kind; });
  for (std::uint32_t i = 0; i < candidates.size(); ++i) candidates[i].info.index = i;
}

std::vector<Candidate> candidates(const vk::raii::Instance& instance) {
  std::vector<Candidate> found;
  std::string unfit;
  std::vector<vk::raii::PhysicalDevice> all;
  try {
    all = instance.enumeratePhysicalDevices();
  } catch (const vk::SystemError& error) {
    throw DeviceError(fmt::format("vkEnumeratePhysicalDevices failed: {}. {}", error.what(), kInstallDriver));
  }
  for (vk::raii::PhysicalDevice& physical : all) {
    const vk::PhysicalDeviceProperties properties = physical.getProperties();
    const std::optional<std::uint32_t> family = computeQueueFamily(physical);
    const bool fits = properties.apiVersion >= kApiVersion && family &&
                      physical.getFeatures2<vk::PhysicalDeviceFeatures2, vk::PhysicalDeviceVulkan12Features>()
                          .get<vk::PhysicalDeviceVulkan12Features>()
                          .timelineSemaphore;
    if (!fits) {
      unfit +=
          fmt::format("\n  {} (Vulkan {})", properties.deviceName.data(), versionText(properties.apiVersion));
      continue;
    }
    const auto driver =
        physical.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceDriverProperties>()
            .get<vk::PhysicalDeviceDriverProperties>();
    DeviceInfo info{.name = properties.deviceName.data(),
                    .kind = kindOf(properties.deviceType),
                    .driver = fmt::format("{} {}", driver.driverName.data(), driver.driverInfo.data()),
                    .apiVersion = versionText(properties.apiVersion)};
    found.push_back({std::move(info), std::move(physical), *family});
  }
  if (found.empty()) {
    if (unfit.empty()) throw DeviceError(fmt::format("no Vulkan device was found. {}", kInstallDriver));
    throw DeviceError(fmt::format(
        "no Vulkan device serves: Vulkan 1.2 with timeline semaphores is needed, and there is only{}\n{}",
        unfit, kInstallDriver));
  }
  rank(found);
  return found;
}

std::size_t select(const std::vector<Candidate>& candidates, std::string_view wanted) {
  if (wanted.empty()) return 0;
  if (std::all_of(wanted.begin(), wanted.end(), [](unsigned char c) { return std::isdigit(c) != 0; })) {
    std::size_t index = candidates.size();
    std::from_chars(wanted.data(), wanted.data() + wanted.size(), index);
    if (index < candidates.size()) return index;
    throw DeviceError(
        fmt::format("there is no Vulkan device with index {}, only{}", wanted, listText(candidates)));
  }
  std::vector<std::size_t> matches;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (lowerCase(candidates[i].info.name).find(lowerCase(wanted)) != std::string::npos) matches.push_back(i);
  if (matches.size() == 1) return matches.front();
  throw DeviceError(fmt::format(
      "the name of {} Vulkan device contains \"{}\"; choose by index or a longer part of a name:{}",
      matches.empty() ? "no" : "more than one", wanted, listText(candidates)));
}

std::string describe(const DeviceInfo& device) {
  constexpr const char* kKinds[] = {"discrete GPU", "integrated GPU", "virtual GPU", "software", "other"};
  return fmt::format("{} ({}, {}, Vulkan {})", device.name, kKinds[static_cast<std::size_t>(device.kind)],
                     device.driver, device.apiVersion);
}

std::vector<DeviceInfo> listDevices() {
  const SoftwareThreads threads(std::nullopt);
  const vk::raii::Context context = openLoader();
  const vk::raii::Instance instance = makeInstance(context, false);
  std::vector<DeviceInfo> infos;
  for (Candidate& candidate : candidates(instance)) infos.push_back(std::move(candidate.info));
  return infos;
}

std::uint64_t Device::validationMessages() {
  return messages().count;
}

std::vector<std::string> Device::validationTexts() {
  Messages& all = messages();
  const std::lock_guard lock(all.mutex);
  return {all.newest.begin(), all.newest.end()};
}

}  // namespace clothstream::vulkan
