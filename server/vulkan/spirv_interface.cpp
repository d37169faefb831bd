// SPDX-License-Identifier: MIT
// Interface of a kernel, read from its SPIR-V.
#include "server/vulkan/spirv_interface.h"

#include <algorithm>
#include <set>
#include <utility>

#include "server/vulkan/spirv_module.h"
#include "server/vulkan/spirv_names.h"

namespace clothstream::vulkan {
namespace {

using namespace spirv;

constexpr std::size_t kHeaderWords = 5;

// Facts about identifiers of a module. All maps are by identifier.
struct Module {
  std::map<std::uint32_t, std::string> names;
  std::map<std::uint32_t, std::uint32_t> specIds, bindings;  // decorations of constants and of variables
  std::map<std::uint32_t, std::uint32_t> pointees, types;    // of pointer types; of variables
  std::map<std::uint32_t, bool> bools;                       // specialisation constants
  std::set<std::uint32_t> nonReadable, nonWritable;          // variables and block types
  std::map<std::uint32_t, BindingKind> textures;             // image types
  std::set<std::uint32_t> used;                              // variables, among others, that functions access
  std::map<std::uint32_t, std::uint32_t> bytes;              // of types, without padding at the end
  std::map<std::uint32_t, std::uint32_t> numbers, strides;   // constants; decorations of array types
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> offsets;  // of members, by number
  std::uint32_t push = 0;                                                   // variable of the push constants

  explicit Module(std::span<const std::uint32_t> spirv) {
    for (std::size_t at = kHeaderWords; at < spirv.size(); at += spirv[at] >> 16)
      add(spirv[at] & 0xFFFF, spirv.subspan(at + 1, (spirv[at] >> 16) - 1));
  }

  void add(std::uint32_t operation, std::span<const std::uint32_t> words) {
    switch (operation) {
      case kName:
        names[words[0]] = textOf(words.subspan(1));
        break;
      case kDecorate:
        if (words[1] == kSpecId) specIds[words[0]] = words[2];
        if (words[1] == kBinding) bindings[words[0]] = words[2];
        if (words[1] == kArrayStride) strides[words[0]] = words[2];
        noteAccess(words[0], words[1]);
        break;
      case kMemberDecorate:
        if (words[2] == kOffset) offsets[words[0]][words[1]] = words[3];
        noteAccess(words[0], words[2]);
        break;
      case kSpecConstantTrue:
      case kSpecConstantFalse:
      case kSpecConstant:
        bools[words[1]] = operation != kSpecConstant;
        break;
      case kConstant:
        numbers[words[1]] = words[2];
        break;
      case kTypeImage:
        textures[words[0]] = words[6] == kUsedWithSampler ? BindingKind::texels : BindingKind::images;
        break;
      case kTypeSampledImage:
        textures[words[0]] = BindingKind::texels;
        break;
      case kTypeInt:
      case kTypeFloat:
        bytes[words[0]] = words[1] / 8;
        break;
      case kTypeVector:
        bytes[words[0]] = bytes[words[1]] * words[2];
        break;
      case kTypeArray:
        bytes[words[0]] = strides[words[0]] * numbers[words[2]];
        break;
      case kTypeStruct:
        for (const auto& [member, offset] : offsets[words[0]])
          bytes[words[0]] = std::max(bytes[words[0]], offset + bytes[words[1 + member]]);
        break;
      case kTypePointer:
        pointees[words[0]] = words[2];
        break;
      case kVariable:
        types[words[1]] = words[0];
        if (words[2] == kPushConstantClass) push = words[1];
        break;
      case kImageTexelPointer:
      case kLoad:
      case kAccessChain:
      case kArrayLength:
        used.insert(words[2]);
        break;
      case kFunctionCall:
        for (const std::uint32_t argument : words.subspan(3)) used.insert(argument);
        break;
      default:
        break;
    }
  }

  void noteAccess(std::uint32_t id, std::uint32_t decoration) {
    if (decoration == kNonWritable) nonWritable.insert(id);
    if (decoration == kNonReadable) nonReadable.insert(id);
  }

  std::uint32_t typeOf(std::uint32_t variable) const { return pointees.at(types.at(variable)); }

  Binding bindingOf(std::uint32_t variable) const {
    const std::uint32_t type = typeOf(variable);
    Binding binding;
    if (const auto name = names.find(variable); name != names.end()) binding.name = name->second;
    if (const auto texture = textures.find(type); texture != textures.end()) binding.kind = texture->second;
    binding.reads = !nonReadable.contains(variable) && !nonReadable.contains(type);
    binding.writes =
        !nonWritable.contains(variable) && !nonWritable.contains(type) && binding.kind != BindingKind::texels;
    return binding;
  }
};

}  // namespace

SpirvInterface interfaceOf(std::span<const std::uint32_t> spirv) {
  const Module module(spirv);
  SpirvInterface found;
  std::size_t count = 0;
  for (const auto& [variable, number] : module.bindings)
    if (module.used.contains(variable)) count = std::max<std::size_t>(count, number + 1);
  found.bindings.resize(count);
  for (const auto& [variable, number] : module.bindings)
    if (number < count) found.bindings[number] = module.bindingOf(variable);
  if (module.push != 0) found.pushConstantBytes = module.bytes.at(module.typeOf(module.push));
  for (const auto& [constant, id] : module.specIds) {
    if (id == 0) continue;
    const auto name = module.names.find(constant);
    std::string text = name == module.names.end() ? "constant" + std::to_string(id) : name->second;
    if (text.size() > 1 && text.front() == 'k') text.erase(0, 1);
    found.constants[id] = {std::move(text), module.bools.at(constant)};
  }
  return found;
}

}  // namespace clothstream::vulkan
