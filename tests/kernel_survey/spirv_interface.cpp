// SPDX-License-Identifier: MIT
// Interface of a kernel, read from its SPIR-V.
#include "tests/kernel_survey/spirv_interface.h"

namespace clothstream::kernel_survey {
namespace {

// Operations and decorations of the SPIR-V specification.
constexpr std::uint32_t kName = 5, kTypeSampledImage = 27, kTypeImage = 25, kTypePointer = 32,
                        kSpecConstantTrue = 48, kSpecConstantFalse = 49, kSpecConstant = 50, kVariable = 59,
                        kDecorate = 71, kMemberDecorate = 72;
constexpr std::uint32_t kSpecId = 1, kNonWritable = 24, kNonReadable = 25, kBinding = 33;
constexpr std::size_t kHeaderWords = 5;
constexpr std::uint32_t kUsedWithSampler = 1;

std::string textAt(std::span<const std::uint32_t> words) {
  std::string text;
  for (const std::uint32_t word : words)
    for (std::uint32_t shift = 0; shift < 32; shift += 8) {
      const char letter = static_cast<char>(word >> shift);
      if (letter == 0) return text;
      text += letter;
    }
  return text;
}

struct Module {
  std::map<std::uint32_t, std::string> names;                // by identifier, as all maps here
  std::map<std::uint32_t, std::uint32_t> specIds, bindings;  // decorations of variables and constants
  std::map<std::uint32_t, std::uint32_t> pointees, types;    // of pointer types; of variables
  std::map<std::uint32_t, bool> bools;                       // specialisation constants
  std::map<std::uint32_t, BindingAccess> access;             // of variables and block types
  std::map<std::uint32_t, bool> sampled;                     // image types: read only

  explicit Module(std::span<const std::uint32_t> spirv) {
    for (std::size_t at = kHeaderWords; at < spirv.size(); at += spirv[at] >> 16)
      add(spirv[at] & 0xFFFF, spirv.subspan(at + 1, (spirv[at] >> 16) - 1));
  }

  void add(std::uint32_t operation, std::span<const std::uint32_t> words) {
    switch (operation) {
      case kName:
        names[words[0]] = textAt(words.subspan(1));
        break;
      case kDecorate:
        if (words[1] == kSpecId) specIds[words[0]] = words[2];
        if (words[1] == kBinding) bindings[words[0]] = words[2];
        decorate(words[0], words[1]);
        break;
      case kMemberDecorate:
        decorate(words[0], words[2]);
        break;
      case kSpecConstantTrue:
      case kSpecConstantFalse:
      case kSpecConstant:
        bools[words[1]] = operation != kSpecConstant;
        break;
      case kTypeImage:
        sampled[words[0]] = words[6] == kUsedWithSampler;
        break;
      case kTypeSampledImage:
        sampled[words[0]] = true;
        break;
      case kTypePointer:
        pointees[words[0]] = words[2];
        break;
      case kVariable:
        types[words[1]] = words[0];
        break;
      default:
        break;
    }
  }

  void decorate(std::uint32_t id, std::uint32_t decoration) {
    if (decoration == kNonWritable) access[id].writes = false;
    if (decoration == kNonReadable) access[id].reads = false;
  }
};

}  // namespace

SpirvInterface interfaceOf(std::span<const std::uint32_t> spirv) {
  const Module module(spirv);
  SpirvInterface found;
  for (const auto& [constant, id] : module.specIds) {
    if (id == 0) continue;
    const auto name = module.names.find(constant);
    std::string text = name == module.names.end() ? "constant" + std::to_string(id) : name->second;
    if (text.size() > 1 && text.front() == 'k') text.erase(0, 1);
    found.constants[id] = {std::move(text), module.bools.at(constant)};
  }
  for (const auto& [variable, number] : module.bindings) {
    const std::uint32_t type = module.pointees.at(module.types.at(variable));
    BindingAccess access;
    if (const auto name = module.names.find(variable); name != module.names.end()) access.name = name->second;
    for (const std::uint32_t id : {variable, type})
      if (const auto known = module.access.find(id); known != module.access.end()) {
        access.reads = access.reads && known->second.reads;
        access.writes = access.writes && known->second.writes;
      }
    if (const auto image = module.sampled.find(type); image != module.sampled.end() && image->second)
      access.writes = false;
    found.bindings[number] = access;
  }
  return found;
}

}  // namespace clothstream::kernel_survey
