// SPDX-License-Identifier: MIT
// A compute pipeline from embedded SPIR-V, and the buffers that are bound to it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"

namespace clothstream::vulkan {

enum class BindingKind : std::uint8_t {
  storage,
  texels,  // read only
  images,  // RGBA32F texels that the kernel also writes
};
inline constexpr auto kStorage = BindingKind::storage;
inline constexpr auto kTexels = BindingKind::texels;
inline constexpr auto kImages = BindingKind::images;

struct KernelDescription {
  const char* name = "";                      // for errors, validation and timings
  std::span<const std::uint32_t> spirv = {};  // from clothstream_add_kernels
  std::vector<BindingKind> bindings = {};     // binding 0, 1, 2, ... of set 0
  std::uint32_t pushConstantBytes = 0;
  // Invocations in x. Kernels declare `layout(local_size_x_id = 0) in;`, which receives this number as
  // constant_id 0.
  std::uint32_t workgroupSize = 64;
  std::vector<std::uint32_t> specialisation = {};  // constant_id 1, 2, 3, ...; pass floats by std::bit_cast
};

// Kernels of one device with the same SPIR-V, specialisation and interface share one pipeline, because
// software devices compile a pipeline when it first runs. Throws std::runtime_error, which names the kernel,
// if the device refuses it.
class Kernel {
 public:
  Kernel(const Device& device, const KernelDescription& description);
  ~Kernel();
  Kernel(Kernel&&) noexcept;
  Kernel& operator=(Kernel&&) noexcept;

  std::uint32_t workgroupSize() const { return workgroupSize_; }

  // Only for this folder (handles.h).
  struct Handles;
  const Handles& handles() const { return *handles_; }
  const std::string& name() const { return name_; }
  std::span<const BindingKind> bindings() const { return bindings_; }
  std::uint32_t pushConstantBytes() const { return pushConstantBytes_; }
  std::span<const std::uint32_t> spirv() const { return spirv_; }
  // KernelDescription::specialisation.
  std::span<const std::uint32_t> specialisation() const { return specialisation_; }

 private:
  static std::shared_ptr<const Handles> makePipeline(const Device::Handles& device,
                                                     const KernelDescription& description,
                                                     std::span<const std::uint32_t> constants);

  std::string name_;
  std::vector<BindingKind> bindings_;
  std::uint32_t pushConstantBytes_ = 0;
  std::uint32_t workgroupSize_ = 0;
  std::span<const std::uint32_t> spirv_;
  std::vector<std::uint32_t> specialisation_;
  std::shared_ptr<const Handles> handles_;
};

// A buffer that is bound.
struct BoundBuffer {
  const void* identity = nullptr;  // differs from that of every other buffer
  std::size_t bytes = 0;
};

// One buffer for each of the kernel's bindings, in order. Kernel and buffers must outlive this object.
class Bindings {
 public:
  Bindings(const Device& device, const Kernel& kernel, std::span<const Buffer* const> buffers);
  Bindings(const Device& device, const Kernel& kernel, std::initializer_list<const Buffer*> buffers)
      : Bindings(device, kernel, std::span(buffers.begin(), buffers.size())) {}
  ~Bindings();
  Bindings(Bindings&&) noexcept;
  Bindings& operator=(Bindings&&) noexcept;

  const Kernel& kernel() const { return *kernel_; }
  std::span<const BoundBuffer> buffers() const { return buffers_; }
  // Only for this folder (handles.h).
  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  const Kernel* kernel_;
  std::vector<BoundBuffer> buffers_;
  std::unique_ptr<Handles> handles_;
};

}  // namespace clothstream::vulkan
