// SPDX-License-Identifier: MIT
// Interface of a kernel, read from its SPIR-V: names of specialisation constants, and how bindings are used.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>

namespace clothstream::kernel_survey {

struct SpecialisationConstant {
  std::string name;  // in the source, without the leading k
  bool isBool = false;
};

struct BindingAccess {
  std::string name = {};  // of the variable; empty for a block
  bool reads = true, writes = true;
};

struct SpirvInterface {
  std::map<std::uint32_t, SpecialisationConstant> constants;  // by constant_id, without the workgroup size
  std::map<std::uint32_t, BindingAccess> bindings;            // of set 0, by number
};

// `spirv` is a valid module of one of our kernels.
SpirvInterface interfaceOf(std::span<const std::uint32_t> spirv);

}  // namespace clothstream::kernel_survey
