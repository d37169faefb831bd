// SPDX-License-Identifier: MIT
// Interface of a kernel, read from its SPIR-V.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace clothstream::vulkan {

enum class BindingKind : std::uint8_t {
  storage,
  texels,  // read only
  images,  // RGBA32F texels that the kernel also writes
};

struct Binding {
  std::string name = {};  // of the variable; empty for a block
  BindingKind kind = BindingKind::storage;
  bool reads = true, writes = true;
};

struct SpecialisationConstant {
  std::string name;  // in the source, without the leading k
  bool isBool = false;
};

struct SpirvInterface {
  std::vector<Binding> bindings;        // binding 0, 1, 2, ... of set 0, up to the last one that is used
  std::uint32_t pushConstantBytes = 0;  // without padding at the end
  std::map<std::uint32_t, SpecialisationConstant> constants;  // by constant_id, without the workgroup size
};

// `spirv` is a valid module with one entry point. Its bindings are in set 0 and are no arrays.
SpirvInterface interfaceOf(std::span<const std::uint32_t> spirv);

}  // namespace clothstream::vulkan
