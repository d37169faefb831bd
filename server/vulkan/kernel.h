// SPDX-License-Identifier: MIT
// A compute pipeline from embedded SPIR-V, and the buffers that are bound to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/spirv_interface.h"

namespace clothstream::vulkan {

// SPIR-V of a kernel. clothstream_add_kernels makes one for each GLSL file: kernels::<name>.
struct KernelCode {
  const char* name = "";  // for errors, validation and timings
  std::span<const std::uint32_t> spirv = {};
};

// A compute pipeline. Copies share it, and so do all kernels of one device with the same code, workgroup size
// and specialisation, because software devices compile a pipeline when it first runs.
class Kernel {
 public:
  // `workgroupSize`: invocations in x. Kernels declare `layout(local_size_x_id = 0) in;`, which receives this
  // number as constant_id 0. `specialisation`: constant_id 1, 2, 3, ...; pass floats by std::bit_cast. Throws
  // std::runtime_error, which names the kernel, if the device refuses it.
  Kernel(const Device& device, const KernelCode& code, std::uint32_t workgroupSize,
         std::span<const std::uint32_t> specialisation = {});
  Kernel(const Device& device, const KernelCode& code, std::uint32_t workgroupSize,
         std::initializer_list<std::uint32_t> specialisation)
      : Kernel(device, code, workgroupSize, std::span(specialisation.begin(), specialisation.size())) {}

  std::string_view name() const;
  std::uint32_t workgroupSize() const;
  std::span<const std::uint32_t> specialisation() const;
  // The interface that its SPIR-V declares.
  const SpirvInterface& interface() const;
  // Whether setReady() was called for this pipeline: it has run, so that the device need not compile it. Any
  // thread.
  bool isReady() const;
  void setReady() const;

  // Only for this folder (handles.h).
  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  std::shared_ptr<const Handles> handles_;
};

// A buffer that is bound.
struct BoundBuffer {
  const void* identity = nullptr;  // differs from that of every other buffer
  std::size_t bytes = 0;
};

// A kernel with one buffer for each of its bindings, in order. The buffers must outlive this object.
class Bindings {
 public:
  // Throws std::runtime_error, which names the kernel, if the device cannot bind the buffers, and
  // std::logic_error if the kernel has another number of bindings.
  Bindings(const Device& device, Kernel kernel, std::span<const Buffer* const> buffers);
  Bindings(const Device& device, Kernel kernel, std::initializer_list<const Buffer*> buffers)
      : Bindings(device, std::move(kernel), std::span(buffers.begin(), buffers.size())) {}
  ~Bindings();
  Bindings(Bindings&&) noexcept;
  Bindings& operator=(Bindings&&) noexcept;

  const Kernel& kernel() const { return kernel_; }
  std::span<const BoundBuffer> buffers() const { return buffers_; }
  // Only for this folder (handles.h).
  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  Kernel kernel_;
  std::vector<BoundBuffer> buffers_;
  std::unique_ptr<Handles> handles_;
};

}  // namespace clothstream::vulkan
