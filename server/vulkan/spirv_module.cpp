// SPDX-License-Identifier: MIT
// A SPIR-V module as lists of instructions, for programs that change it.
#include "server/vulkan/spirv_module.h"

#include <stdexcept>

#include <fmt/format.h>

#include "server/vulkan/spirv_names.h"

namespace clothstream::vulkan {
namespace {

constexpr std::size_t kModuleHeaderWords = 5;
constexpr std::uint32_t kMagic = 0x07230203;

bool isAnnotation(std::uint32_t operation) {
  return (operation >= spirv::kDecorate && operation <= spirv::kGroupMemberDecorate) ||
         operation == spirv::kDecorateId || operation == spirv::kDecorateString ||
         operation == spirv::kMemberDecorateString;
}

// True for the first type, constant or variable of the module, and for those that follow it.
bool isGlobal(std::uint32_t operation) {
  return (operation >= spirv::kTypeVoid && operation <= spirv::kTypeForwardPointer) ||
         (operation >= spirv::kConstantTrue && operation <= spirv::kSpecConstantOp) ||
         operation == spirv::kVariable || operation == spirv::kUndef;
}

}  // namespace

std::string textOf(std::span<const std::uint32_t> words) {
  std::string text;
  for (const std::uint32_t word : words)
    for (std::uint32_t shift = 0; shift < 32; shift += 8) {
      const char letter = static_cast<char>(word >> shift);
      if (letter == 0) return text;
      text += letter;
    }
  return text;
}

SpirvModule::SpirvModule(std::span<const std::uint32_t> spirv) {
  if (spirv.size() < kModuleHeaderWords || spirv[0] != kMagic)
    throw std::runtime_error("this is no SPIR-V: it does not begin with a header of SPIR-V");
  version = spirv[1];
  generator = spirv[2];
  bound = spirv[3];
  std::vector<Instruction>* part = &preamble;
  for (std::size_t at = kModuleHeaderWords; at < spirv.size();) {
    const std::uint32_t operation = spirv[at] & 0xFFFF, length = spirv[at] >> 16;
    if (length == 0 || length > spirv.size() - at)
      throw std::runtime_error(
          fmt::format("word {} of SPIR-V states a length of {} words, of {} words that follow", at, length,
                      spirv.size() - at));
    if (operation == spirv::kFunction)
      part = &functions;
    else if (part != &functions && isGlobal(operation))
      part = &globals;
    else if (part == &preamble && isAnnotation(operation))
      part = &annotations;
    const std::span<const std::uint32_t> words = spirv.subspan(at + 1, length - 1);
    part->push_back({operation, {words.begin(), words.end()}});
    at += length;
  }
}

std::vector<std::uint32_t> SpirvModule::spirv() const {
  std::vector<std::uint32_t> made{kMagic, version, generator, bound, 0};
  for (const std::vector<Instruction>* part : {&preamble, &annotations, &globals, &functions})
    for (const Instruction& instruction : *part) {
      made.push_back(static_cast<std::uint32_t>(instruction.words.size() + 1) << 16 | instruction.operation);
      made.insert(made.end(), instruction.words.begin(), instruction.words.end());
    }
  return made;
}

}  // namespace clothstream::vulkan
