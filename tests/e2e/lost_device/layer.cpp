// SPDX-License-Identifier: MIT
// Vulkan layer that simulates a lost device. CLOTHSTREAM_LOSE_DEVICE names a file. At the first submission
// after the file appears, the layer removes the file and the device is lost. From then on its queues and
// semaphores return VK_ERROR_DEVICE_LOST; other devices work. If the file contains "memory N", the next N
// submissions fail with VK_ERROR_OUT_OF_HOST_MEMORY instead. Default N is 1. If it contains "hang", the
// submission does not return.
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include <unistd.h>
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

namespace {

// Key of an instance or device; its child objects have the same key.
void* keyOf(const void* dispatchable) {
  return *static_cast<void* const*>(dispatchable);
}

struct Instance {
  PFN_vkGetInstanceProcAddr next;
  VkInstance handle;
};

struct Device {
  PFN_vkGetDeviceProcAddr getProcAddr;
  PFN_vkDestroyDevice destroy;
  PFN_vkQueueSubmit submit;
  PFN_vkQueueWaitIdle queueWaitIdle;
  PFN_vkDeviceWaitIdle waitIdle;
  PFN_vkWaitSemaphores waitSemaphores;
  PFN_vkGetSemaphoreCounterValue counter;
  std::atomic<bool> lost{false};
  std::atomic<int> failing{0};  // number of next submissions that fail

  // Result of the next submission.
  VkResult fate() {
    const char* const name = std::getenv("CLOTHSTREAM_LOSE_DEVICE");
    // A file that appears after this check affects the next submission.
    if (std::ifstream file(name != nullptr ? name : ""); file && unlink(name) == 0) {
      std::string word;
      int count = 1;
      file >> word;
      if (int given = 0; file >> given) count = given;
      while (word == "hang") pause();
      if (word == "memory")
        failing = count;
      else
        lost = true;
    }
    if (failing > 0) {
      --failing;
      return VK_ERROR_OUT_OF_HOST_MEMORY;
    }
    return lost ? VK_ERROR_DEVICE_LOST : VK_SUCCESS;
  }
};

std::mutex mutex;
std::map<void*, Instance> instances;
std::map<void*, std::shared_ptr<Device>> devices;

Instance instanceOf(const void* dispatchable) {
  const std::lock_guard lock(mutex);
  return instances.at(keyOf(dispatchable));
}
std::shared_ptr<Device> deviceOf(const void* dispatchable) {
  const std::lock_guard lock(mutex);
  return devices.at(keyOf(dispatchable));
}

template <class Info>
Info* linkIn(const void* chain, VkStructureType type) {
  auto* info = const_cast<Info*>(static_cast<const Info*>(chain));
  while (info != nullptr && (info->sType != type || info->function != VK_LAYER_LINK_INFO))
    info = const_cast<Info*>(static_cast<const Info*>(info->pNext));
  return info;
}

template <class Function>
Function as(PFN_vkVoidFunction function) {
  return reinterpret_cast<Function>(function);
}

VKAPI_ATTR VkResult VKAPI_CALL createInstance(const VkInstanceCreateInfo* info,
                                              const VkAllocationCallbacks* allocator, VkInstance* instance) {
  auto* const link =
      linkIn<VkLayerInstanceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO);
  if (link == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
  const PFN_vkGetInstanceProcAddr next = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const VkResult result =
      as<PFN_vkCreateInstance>(next(nullptr, "vkCreateInstance"))(info, allocator, instance);
  if (result != VK_SUCCESS) return result;
  const std::lock_guard lock(mutex);
  instances[keyOf(*instance)] = {next, *instance};
  return result;
}

VKAPI_ATTR VkResult VKAPI_CALL createDevice(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                            const VkAllocationCallbacks* allocator, VkDevice* handle) {
  auto* const link =
      linkIn<VkLayerDeviceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO);
  if (link == nullptr) return VK_ERROR_INITIALIZATION_FAILED;
  const Instance instance = instanceOf(physical);
  const PFN_vkGetDeviceProcAddr next = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const VkResult result = as<PFN_vkCreateDevice>(instance.next(instance.handle, "vkCreateDevice"))(
      physical, info, allocator, handle);
  if (result != VK_SUCCESS) return result;
  auto device = std::make_shared<Device>();
  device->getProcAddr = next;
  device->destroy = as<PFN_vkDestroyDevice>(next(*handle, "vkDestroyDevice"));
  device->submit = as<PFN_vkQueueSubmit>(next(*handle, "vkQueueSubmit"));
  device->queueWaitIdle = as<PFN_vkQueueWaitIdle>(next(*handle, "vkQueueWaitIdle"));
  device->waitIdle = as<PFN_vkDeviceWaitIdle>(next(*handle, "vkDeviceWaitIdle"));
  device->waitSemaphores = as<PFN_vkWaitSemaphores>(next(*handle, "vkWaitSemaphores"));
  device->counter = as<PFN_vkGetSemaphoreCounterValue>(next(*handle, "vkGetSemaphoreCounterValue"));
  const std::lock_guard lock(mutex);
  devices[keyOf(*handle)] = std::move(device);
  return result;
}

VKAPI_ATTR void VKAPI_CALL destroyDevice(VkDevice handle, const VkAllocationCallbacks* allocator) {
  if (handle == VK_NULL_HANDLE) return;
  const std::shared_ptr<Device> device = deviceOf(handle);
  {
    const std::lock_guard lock(mutex);
    devices.erase(keyOf(handle));
  }
  // The driver may still run work that was submitted before the loss.
  device->waitIdle(handle);
  device->destroy(handle, allocator);
}

VKAPI_ATTR VkResult VKAPI_CALL queueSubmit(VkQueue queue, std::uint32_t count, const VkSubmitInfo* submits,
                                           VkFence fence) {
  const std::shared_ptr<Device> device = deviceOf(queue);
  const VkResult fate = device->fate();
  return fate == VK_SUCCESS ? device->submit(queue, count, submits, fence) : fate;
}
VKAPI_ATTR VkResult VKAPI_CALL queueWaitIdle(VkQueue queue) {
  const std::shared_ptr<Device> device = deviceOf(queue);
  return device->lost ? VK_ERROR_DEVICE_LOST : device->queueWaitIdle(queue);
}
VKAPI_ATTR VkResult VKAPI_CALL deviceWaitIdle(VkDevice handle) {
  const std::shared_ptr<Device> device = deviceOf(handle);
  return device->lost ? VK_ERROR_DEVICE_LOST : device->waitIdle(handle);
}
VKAPI_ATTR VkResult VKAPI_CALL waitSemaphores(VkDevice handle, const VkSemaphoreWaitInfo* info,
                                              std::uint64_t timeout) {
  const std::shared_ptr<Device> device = deviceOf(handle);
  return device->lost ? VK_ERROR_DEVICE_LOST : device->waitSemaphores(handle, info, timeout);
}
VKAPI_ATTR VkResult VKAPI_CALL counterValue(VkDevice handle, VkSemaphore semaphore, std::uint64_t* value) {
  const std::shared_ptr<Device> device = deviceOf(handle);
  return device->lost ? VK_ERROR_DEVICE_LOST : device->counter(handle, semaphore, value);
}

PFN_vkVoidFunction intercepted(const char* name) {
  struct Named {
    const char* name;
    PFN_vkVoidFunction function;
  };
#define CLOTHSTREAM_NAMED(name, function) \
  { name, reinterpret_cast<PFN_vkVoidFunction>(&(function)) }
  static const Named kIntercepted[]{
      CLOTHSTREAM_NAMED("vkCreateInstance", createInstance),
      CLOTHSTREAM_NAMED("vkCreateDevice", createDevice),
      CLOTHSTREAM_NAMED("vkDestroyDevice", destroyDevice),
      CLOTHSTREAM_NAMED("vkQueueSubmit", queueSubmit),
      CLOTHSTREAM_NAMED("vkQueueWaitIdle", queueWaitIdle),
      CLOTHSTREAM_NAMED("vkDeviceWaitIdle", deviceWaitIdle),
      CLOTHSTREAM_NAMED("vkWaitSemaphores", waitSemaphores),
      CLOTHSTREAM_NAMED("vkGetSemaphoreCounterValue", counterValue),
  };
#undef CLOTHSTREAM_NAMED
  for (const Named& one : kIntercepted)
    if (std::strcmp(one.name, name) == 0) return one.function;
  return nullptr;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL getDeviceProcAddr(VkDevice handle, const char* name) {
  if (std::strcmp(name, "vkGetDeviceProcAddr") == 0)
    return reinterpret_cast<PFN_vkVoidFunction>(&getDeviceProcAddr);
  if (const PFN_vkVoidFunction function = intercepted(name)) return function;
  return deviceOf(handle)->getProcAddr(handle, name);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL getInstanceProcAddr(VkInstance handle, const char* name) {
  if (std::strcmp(name, "vkGetInstanceProcAddr") == 0)
    return reinterpret_cast<PFN_vkVoidFunction>(&getInstanceProcAddr);
  if (std::strcmp(name, "vkGetDeviceProcAddr") == 0)
    return reinterpret_cast<PFN_vkVoidFunction>(&getDeviceProcAddr);
  if (const PFN_vkVoidFunction function = intercepted(name)) return function;
  return handle == VK_NULL_HANDLE ? nullptr : instanceOf(handle).next(handle, name);
}

}  // namespace

extern "C" __attribute__((visibility("default"))) VkResult vkNegotiateLoaderLayerInterfaceVersion(
    VkNegotiateLayerInterface* negotiated) {
  if (negotiated->loaderLayerInterfaceVersion < 2) return VK_ERROR_INITIALIZATION_FAILED;
  negotiated->loaderLayerInterfaceVersion = 2;
  negotiated->pfnGetInstanceProcAddr = &getInstanceProcAddr;
  negotiated->pfnGetDeviceProcAddr = &getDeviceProcAddr;
  negotiated->pfnGetPhysicalDeviceProcAddr = nullptr;
  return VK_SUCCESS;
}
