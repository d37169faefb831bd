// SPDX-License-Identifier: MIT
// Records work for the device: bind, push, dispatch, copy, barrier, timestamp.
#pragma once

#include <cstdint>
#include <string_view>
#include <type_traits>
#include <vector>

#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"

namespace clothstream::vulkan {

struct StageTime {
  std::string_view stage;  // as passed to beginStage; static storage
  double seconds = 0;
};

// One command buffer and its timestamps, used again and again. Belongs to the device's thread.
class Recorder {
 public:
  explicit Recorder(const Device& device);

  // Forgets what was recorded; what was submitted must be complete.
  void begin();

  // Until the next beginStage or the end, work counts to this stage (names in static storage; at most 32 stages a
  // recording; the same name may come again and is added up).
  void beginStage(std::string_view stage);

  // Runs the kernel on at least `threads` invocations in x (whole workgroups: the kernel guards its bounds).
  template <typename Push>
  void dispatch(const Bindings& bindings, const Push& push, std::uint64_t threads) {
    static_assert(std::is_trivially_copyable_v<Push>);
    dispatchBytes(bindings, &push, sizeof(Push), threads);
  }
  void dispatch(const Bindings& bindings, std::uint64_t threads) {
    dispatchBytes(bindings, nullptr, 0, threads);
  }

  // What comes after sees what came before (kernels and copies).
  void barrier();

  void copy(const Buffer& from, const Buffer& to, std::size_t bytes, std::size_t fromOffset = 0,
            std::size_t toOffset = 0);
  // `bytes` a multiple of 4.
  void fill(const Buffer& buffer, std::uint32_t value, std::size_t bytes, std::size_t offset = 0);

  // Device seconds of each stage of the last submitted recording, in order of first appearance; call when it is
  // complete.
  std::vector<StageTime> stageTimes() const;

  // For this room alone: ends the recording (with a barrier towards the host).
  const vk::raii::CommandBuffer& finish();

 private:
  void dispatchBytes(const Bindings& bindings, const void* push, std::uint32_t pushBytes, std::uint64_t threads);

  const Device* device_;
  vk::raii::CommandPool pool_ = nullptr;
  vk::raii::CommandBuffers buffers_ = nullptr;
  vk::raii::QueryPool timestamps_ = nullptr;
  std::vector<std::string_view> stages_;
  bool open_ = false;
};

}  // namespace clothstream::vulkan
