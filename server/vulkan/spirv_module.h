// SPDX-License-Identifier: MIT
// A SPIR-V module as lists of instructions, for programs that change it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace clothstream::vulkan {

struct Instruction {
  std::uint32_t operation = 0;
  std::vector<std::uint32_t> words = {};  // after the first one, which has operation and length

  bool operator==(const Instruction&) const = default;
};

// Text in the words of an instruction, such as a name.
std::string textOf(std::span<const std::uint32_t> words);

// The parts of a module in the order that the specification prescribes (section 2.4).
struct SpirvModule {
  // Throws std::runtime_error if `spirv` is no sequence of instructions after a header.
  explicit SpirvModule(std::span<const std::uint32_t> spirv);

  // The module as words.
  std::vector<std::uint32_t> spirv() const;

  std::uint32_t newId() { return bound++; }

  std::uint32_t version = 0;             // 0x00010500 is 1.5
  std::uint32_t generator = 0;           // number of the compiler
  std::uint32_t bound = 0;               // above all identifiers
  std::vector<Instruction> preamble;     // capabilities, entry points, execution modes, names
  std::vector<Instruction> annotations;  // decorations
  std::vector<Instruction> globals;      // types, constants, variables of the module
  std::vector<Instruction> functions;
};

}  // namespace clothstream::vulkan
