// SPDX-License-Identifier: MIT
// The shared form of a kernel, made from the kernel's SPIR-V.
#include "server/vulkan/shared_code.h"

#include <algorithm>
#include <initializer_list>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "server/vulkan/spirv_interface.h"
#include "server/vulkan/spirv_module.h"
#include "server/vulkan/spirv_names.h"

namespace clothstream::vulkan {
namespace {

using namespace spirv;
using Words = std::vector<std::uint32_t>;

constexpr std::uint32_t kSpirv15 = 0x00010500;
constexpr std::uint32_t kTexelStride = 16;
constexpr std::uint32_t kAddressBytes = sizeof(std::uint64_t);

[[noreturn]] void refuse(const std::string& reason) {
  throw std::runtime_error("the kernel has no shared form: " + reason);
}

// The words of an instruction of a function that may be identifiers. Literals are left out where they are
// common, so that none is mistaken for an identifier.
Words identifiersIn(const Instruction& instruction) {
  const auto first = [&](std::size_t count) {
    return Words(
        instruction.words.begin(),
        instruction.words.begin() + static_cast<std::ptrdiff_t>(std::min(count, instruction.words.size())));
  };
  switch (instruction.operation) {
    case kFunction:
    case kVariable:
    case kSelectionMerge:
    case kSwitch:
    case kBranchConditional:
      return first(1);
    case kLoopMerge:
      return first(2);
    case kCompositeExtract:
      return first(3);
    case kVectorShuffle:
    case kCompositeInsert:
      return first(4);
    case kExtInst: {
      Words words = instruction.words;
      words.erase(words.begin() + 3);  // number in the set of instructions
      return words;
    }
    default:
      return instruction.words;
  }
}

// Makes the shared form of a module. A variable of a buffer or of push constants keeps its identifier, and
// becomes a private variable that holds the address. The new entry function sets these variables.
class SharedForm {
 public:
  explicit SharedForm(std::span<const std::uint32_t> spirv) : module_(spirv) {
    if (module_.version < kSpirv15) refuse("it is older than SPIR-V 1.5");
    readAnnotations();
    readGlobals();
    changeAnnotations();
    changeGlobals();
    changeFunctions();
    const std::uint32_t entry = addEntry(interfaceOf(spirv).bindings.size());
    changePreamble(entry);
  }

  Words spirv() const { return module_.spirv(); }

 private:
  // A variable that becomes an address.
  struct Variable {
    std::uint32_t type = 0;     // of the pointer
    std::uint32_t storage = 0;  // storage class in the kernel
    std::uint32_t length = 0;   // private variable with the length of its runtime array; 0: none
    bool used = false;
  };
  struct Member {
    std::uint32_t type, offset;
  };

  // A pointer to a component of a vector: the chain to the vector, its type, and the component.
  struct Component {
    Words chain;  // base and indices
    std::uint32_t vector = 0, index = 0;
  };

  // Facts about the module.

  void readAnnotations() {
    for (const auto& [operation, words] : module_.annotations) {
      if (operation >= kDecorationGroup && operation <= kGroupMemberDecorate)
        refuse("it has groups of decorations");
      if (operation == kDecorate) decorations_[words[0]][words[1]] = words.size() > 2 ? words[2] : 0;
    }
  }

  void readGlobals() {
    for (const Instruction& global : module_.globals) {
      const auto& [operation, words] = global;
      const bool isType = operation >= kTypeVoid && operation <= kTypeForwardPointer;
      if (isType || words.size() > 1) definitions_[words[isType ? 0 : 1]] = global;
      if (operation == kTypeImage || operation == kTypeSampledImage) readTexels(global);
      if (operation == kTypePointer) readPointer(words[0], words[1], words[2]);
      if (operation == kVariable) readVariable(words[1], words[0], words[2]);
    }
  }

  void readTexels(const Instruction& type) {
    const Words& words = type.words;
    images_.insert(words[0]);
    changed_.insert(words[0]);
    if (type.operation == kTypeSampledImage) return;
    const bool isPlain = words[2] == kBufferDimension && words[4] == 0 && words[5] == 0;
    const bool sampled = words[6] == kUsedWithSampler;
    if (!isPlain || definition(words[1]).operation != kTypeFloat || (!sampled && words[7] != kRgba32f))
      refuse(fmt::format("the image type {} is no buffer of RGBA32F texels", nameOf(words[0])));
    if (!sampled) hasImages_ = true;
  }

  void readPointer(std::uint32_t id, std::uint32_t storage, std::uint32_t to) {
    const bool isTexels = storage == kUniformConstantClass && images_.contains(to);
    if (!isTexels && storage != kStorageBufferClass && storage != kPushConstantClass) return;
    pointees_[id] = to;
    changed_.insert(id);
  }

  void readVariable(std::uint32_t id, std::uint32_t type, std::uint32_t storage) {
    if (pointees_.contains(type)) {
      const bool isBlock = definition(pointees_[type]).operation == kTypeStruct;
      if (!isBlock && storage != kUniformConstantClass)
        refuse(fmt::format("{} is an array of bindings", nameOf(id)));
      variables_[id] = {.type = type, .storage = storage};
      types_[id] = type;
      changed_.insert(id);
      return;
    }
    if (storage == kPrivateClass || storage == kWorkgroupClass) return;
    if (storage != kInputClass) refuse(fmt::format("{} has storage class {}", nameOf(id), storage));
    const std::uint32_t builtIn = decoration(id, kBuiltIn);
    if (builtIn == kNumWorkgroups) groupCount_ = id;
    if (builtIn == kWorkgroupId) workgroup_ = id;
    if (builtIn == kNumWorkgroups || builtIn == kWorkgroupId || builtIn == kGlobalInvocationId)
      changed_.insert(id);
  }

  const Instruction& definition(std::uint32_t id) const {
    const auto known = definitions_.find(id);
    if (known == definitions_.end()) refuse(fmt::format("{} is not defined", nameOf(id)));
    return known->second;
  }

  bool isDecorated(std::uint32_t id, std::uint32_t with) const {
    const auto known = decorations_.find(id);
    return known != decorations_.end() && known->second.contains(with);
  }

  // The number in a decoration; 0 without this decoration.
  std::uint32_t decoration(std::uint32_t id, std::uint32_t which) const {
    return isDecorated(id, which) ? decorations_.at(id).at(which) : 0;
  }

  std::uint32_t offsetOf(std::uint32_t structure, std::uint32_t member) const {
    for (const auto& [operation, words] : module_.annotations)
      if (operation == kMemberDecorate && words[0] == structure && words[1] == member && words[2] == kOffset)
        return words[3];
    refuse(fmt::format("member {} of {} has no offset", member, nameOf(structure)));
  }

  // Type of what an index leads to, from a structure or array of this type.
  std::uint32_t typeAt(std::uint32_t type, std::uint32_t index) const {
    const auto& [operation, words] = definition(type);
    if (operation == kTypeStruct) return words.at(1 + valueOf(index));
    if (operation == kTypeArray || operation == kTypeRuntimeArray) return words[1];
    refuse(fmt::format("an index leads into type {}", nameOf(type)));
  }

  // Value of a constant that cannot be specialised; nothing else has one here.
  std::uint32_t valueOf(std::uint32_t id) const {
    const Instruction& constant = definition(id);
    if (constant.operation != kConstant || constant.words.size() != 3)
      refuse(fmt::format("{} is no constant", nameOf(id)));
    return constant.words[2];
  }

  // Base alignment of a type by the rules of std430, in bytes.
  std::uint32_t alignmentOf(std::uint32_t type) const {
    const auto& [operation, words] = definition(type);
    std::uint32_t most = 0;
    switch (operation) {
      case kTypeInt:
      case kTypeFloat:
        return words[1] / 8;
      case kTypeVector:
        return alignmentOf(words[1]) * (words[2] == 2 ? 2 : 4);
      case kTypeArray:
      case kTypeRuntimeArray:
        return alignmentOf(words[1]);
      case kTypeStruct:
        for (std::size_t i = 1; i < words.size(); ++i) most = std::max(most, alignmentOf(words[i]));
        return most;
      case kTypePointer:
        return kAddressBytes;
      default:
        refuse(fmt::format("memory has a value of type {}", nameOf(type)));
    }
  }

  std::string nameOf(std::uint32_t id) const {
    for (const auto& [operation, words] : module_.preamble)
      if (operation == kName && words[0] == id && words[1] != 0) return textOf(std::span(words).subspan(1));
    return fmt::format("%{}", id);
  }

  // Additions to the module.

  std::uint32_t addType(std::uint32_t operation, Words operands) {
    const std::uint32_t id = module_.newId();
    operands.insert(operands.begin(), id);
    module_.globals.push_back({operation, std::move(operands)});
    definitions_[id] = module_.globals.back();
    return id;
  }

  // A type that the module may have only once, or need not have twice.
  std::uint32_t typeOf(std::uint32_t operation, const Words& operands) {
    for (const auto& [known, words] : module_.globals)
      if (known == operation && std::ranges::equal(std::span(words).subspan(1), operands)) return words[0];
    return addType(operation, operands);
  }

  std::uint32_t unsignedType() { return typeOf(kTypeInt, {32, 0}); }
  std::uint32_t texelType() { return typeOf(kTypeVector, {typeOf(kTypeFloat, {32}), 4}); }
  std::uint32_t pointerTo(std::uint32_t type, std::uint32_t storage) {
    return typeOf(kTypePointer, {storage, type});
  }

  std::uint32_t constant(std::uint32_t value) {
    const std::uint32_t type = unsignedType();
    for (const auto& [operation, words] : module_.globals)
      if (operation == kConstant && words[0] == type && words[2] == value) return words[1];
    const std::uint32_t id = module_.newId();
    module_.globals.push_back({kConstant, {type, id, value}});
    return id;
  }

  std::uint32_t addVariable(std::uint32_t type, std::uint32_t storage) {
    const std::uint32_t pointer = pointerTo(type, storage), id = module_.newId();
    module_.globals.push_back({kVariable, {pointer, id, storage}});
    added_.push_back(id);
    return id;
  }

  void annotate(Words words) { module_.annotations.push_back({kDecorate, std::move(words)}); }

  void annotateMember(std::uint32_t structure, std::uint32_t member, const Words& with) {
    Instruction annotation{kMemberDecorate, {structure, member}};
    annotation.words.insert(annotation.words.end(), with.begin(), with.end());
    if (std::ranges::find(module_.annotations, annotation) == module_.annotations.end())
      module_.annotations.push_back(std::move(annotation));
  }

  // For all members of the structure.
  void annotateMembers(std::uint32_t structure, std::uint32_t with) {
    const auto count = static_cast<std::uint32_t>(definition(structure).words.size() - 1);
    for (std::uint32_t member = 0; member < count; ++member) annotateMember(structure, member, {with});
  }

  std::uint32_t addStructure(std::span<const Member> members) {
    Words types;
    for (const Member& member : members) types.push_back(member.type);
    const std::uint32_t id = addType(kTypeStruct, types);
    for (std::uint32_t i = 0; i < members.size(); ++i) annotateMember(id, i, {kOffset, members[i].offset});
    return id;
  }

  // A block with these members, or a structure without the decoration, that nothing writes.
  std::uint32_t addInput(std::span<const Member> members, bool isBlock = true) {
    const std::uint32_t id = addStructure(members);
    if (isBlock) annotate({id, kBlock});
    annotateMembers(id, kNonWritable);
    return id;
  }

  std::uint32_t addArrayBlock(std::uint32_t element, std::uint32_t stride) {
    const std::uint32_t array = addType(kTypeRuntimeArray, {element});
    annotate({array, kArrayStride, stride});
    return addInput(std::vector<Member>{{array, 0}});
  }

  // Changes of types, variables and decorations.

  // Decorations of buffers describe descriptors. Those of memory accesses move to the members.
  void changeAnnotations() {
    std::erase_if(module_.annotations, [&](const Instruction& annotation) {
      const std::uint32_t target = annotation.words[0];
      return variables_.contains(target) || target == groupCount_ || images_.contains(target);
    });
    for (const auto& [id, variable] : variables_) {
      const bool isPush = variable.storage == kPushConstantClass;
      // Nothing else reaches the memory of push constants.
      annotate({id, isPush || isDecorated(id, kRestrict) ? kRestrictPointer : kAliasedPointer});
      const std::uint32_t block = pointees_.at(variable.type);
      if (isPush) annotateMembers(block, kNonWritable);
      if (variable.storage != kStorageBufferClass) continue;
      for (const std::uint32_t access : {kCoherent, kVolatile})
        if (isDecorated(id, access)) annotateMembers(block, access);
    }
  }

  // Pointers are defined after all other types, because blocks of texels come to be here.
  void changeGlobals() {
    const std::vector<Instruction> kernel = std::exchange(module_.globals, {});
    std::vector<Instruction> pointers, functions, variables;
    for (const Instruction& global : kernel) {
      const auto& [operation, words] = global;
      if (images_.contains(words[0]) && operation != kTypePointer) continue;
      if (operation == kTypePointer && pointees_.contains(words[0]))
        pointers.push_back(global);
      else if (operation == kTypeFunction)
        functions.push_back(global);
      else if (operation == kVariable && (variables_.contains(words[1]) || words[1] == groupCount_))
        variables.push_back(global);
      else
        keepGlobal(global);
    }
    for (Instruction& pointer : pointers) {
      std::uint32_t& to = pointees_[pointer.words[0]];
      if (images_.contains(to)) to = addTexels(pointer.words[0]);
      pointer.words = {pointer.words[0], kPhysicalStorageBufferClass, to};
      module_.globals.push_back(pointer);
      definitions_[pointer.words[0]] = pointer;
    }
    for (const Instruction& function : functions) {
      for (const std::uint32_t type : function.words)
        if (images_.contains(type)) refuse("a function has an image as parameter by value");
      module_.globals.push_back(function);
    }
    for (Instruction& variable : variables) {
      const std::uint32_t id = variable.words[1];
      const std::uint32_t type =
          id == groupCount_ ? definition(variable.words[0]).words[2] : variables_.at(id).type;
      variable.words = {pointerTo(type, kPrivateClass), id, kPrivateClass};
      module_.globals.push_back(variable);
    }
  }

  // Keeps a global as it is. It must not depend on what changes.
  void keepGlobal(const Instruction& global) {
    const auto& [operation, words] = global;
    const bool hasTypes = operation == kTypeStruct || operation == kTypeArray ||
                          operation == kTypeRuntimeArray || operation == kTypePointer;
    const std::size_t first = hasTypes ? (operation == kTypePointer ? 2 : 1) : 0;
    const std::size_t end = hasTypes ? words.size() : std::min<std::size_t>(words.size(), 1);
    for (std::size_t i = first; i < end; ++i)
      if (changed_.contains(words[i]) && words[i] != groupCount_)
        refuse(fmt::format("{} depends on {}", nameOf(words[0]), nameOf(words[i])));
    module_.globals.push_back(global);
  }

  // The block that texels behind this type of pointer become.
  std::uint32_t addTexels(std::uint32_t pointer) {
    const std::uint32_t block = addArrayBlock(texelType(), kTexelStride);
    for (const auto& [id, variable] : variables_)
      if (variable.type == pointer)
        for (const std::uint32_t access : {kCoherent, kVolatile})
          if (isDecorated(id, access)) annotateMember(block, 0, {access});
    return block;
  }

  // Changes of functions.

  std::uint32_t emit(std::uint32_t operation, std::uint32_t type, const Words& operands) {
    const std::uint32_t id = module_.newId();
    Instruction made{operation, {type, id}};
    made.words.insert(made.words.end(), operands.begin(), operands.end());
    module_.functions.push_back(std::move(made));
    return id;
  }

  void changeFunctions() {
    std::vector<Instruction> kernel = std::exchange(module_.functions, {});
    for (Instruction& instruction : kernel)
      if (change(instruction)) module_.functions.push_back(std::move(instruction));
    const auto isGone = [&](const Instruction& about) { return texels_.contains(about.words[0]); };
    std::erase_if(module_.annotations, isGone);
  }

  // Changes an instruction, and emits what it needs before it. False if the instruction is left out.
  bool change(Instruction& instruction) {
    const std::uint32_t operation = instruction.operation;
    Words& words = instruction.words;
    switch (operation) {
      case kFunctionParameter:
        if (pointees_.contains(words[0])) addParameter(words[1], words[0]);
        return true;
      case kLoad:
        return changeLoad(instruction);
      case kStore:
        if (const std::uint32_t type = usePointer(words[0])) align(words, 2, pointees_.at(type));
        refuseUse(operation, words[1]);
        return true;
      case kAccessChain:
      case kInBoundsAccessChain:
        changeChain(words);
        return true;
      case kArrayLength:
        changeLength(instruction);
        return true;
      case kImage:
        texels_[words[1]] = texelsOf(words[2]);
        changed_.insert(words[1]);
        return false;
      case kImageFetch:
      case kImageRead:
        changeFetch(instruction);
        return true;
      case kFunctionCall:
        for (std::size_t i = 3; i < words.size(); ++i) usePointer(words[i]);
        refuseUse(operation, words[0]);
        return true;
      case kControlBarrier:
        checkSemantics(words[2]);
        return true;
      case kMemoryBarrier:
        checkSemantics(words[1]);
        return true;
      default:
        break;
    }
    if (operation >= kAtomicLoad && operation <= kAtomicXor) {
      const bool hasResult = operation != kAtomicStore;
      usePointer(words[hasResult ? 2 : 0]);
      checkSemantics(words[hasResult ? 4 : 2]);
      return true;
    }
    for (const std::uint32_t id : identifiersIn(instruction)) refuseUse(operation, id);
    return true;
  }

  void refuseUse(std::uint32_t operation, std::uint32_t id) const {
    if (changed_.contains(id)) refuse(fmt::format("operation {} uses {}", operation, nameOf(id)));
  }

  void addParameter(std::uint32_t id, std::uint32_t type) {
    types_[id] = type;
    changed_.insert(id);
    if (!isDecorated(id, kRestrict) && !isDecorated(id, kAliased)) annotate({id, kAliased});
  }

  // The type of a pointer that is an address now; 0 for other pointers. A variable is replaced by its value.
  std::uint32_t usePointer(std::uint32_t& pointer) {
    const auto known = types_.find(pointer);
    if (known == types_.end()) {
      if (changed_.contains(pointer)) refuse(fmt::format("{} is used as a whole", nameOf(pointer)));
      return 0;
    }
    const std::uint32_t type = known->second;
    if (const auto variable = variables_.find(pointer); variable != variables_.end()) {
      variable->second.used = true;
      pointer = emit(kLoad, type, {pointer});
    }
    return type;
  }

  // Accesses to addresses state an alignment. `at` is the place of the memory operands.
  void align(Words& words, std::size_t at, std::uint32_t type) const {
    if (words.size() == at) words.push_back(0);
    if ((words[at] & kAlignedBit) != 0) return;
    words[at] |= kAlignedBit;
    words.insert(words.begin() + static_cast<std::ptrdiff_t>(at) + 1, alignmentOf(type));
  }

  bool changeLoad(Instruction& instruction) {
    Words& words = instruction.words;
    if (words[2] == groupCount_ || groupCounts_.contains(words[2])) return true;
    if (const auto component = components_.find(words[2]); component != components_.end()) {
      loadComponent(instruction, component->second);
      return true;
    }
    const std::uint32_t type = usePointer(words[2]);
    if (images_.contains(words[0])) {
      texels_[words[1]] = words[2];
      changed_.insert(words[1]);
      return false;
    }
    if (type != 0) align(words, 3, words[0]);
    return true;
  }

  // Loads the whole vector. Mesa 22.3 confuses the components if a kernel loads both a vector and a component
  // of it through an address.
  void loadComponent(Instruction& load, const Component& of) {
    const std::uint32_t vector =
        emit(kAccessChain, pointerTo(of.vector, kPhysicalStorageBufferClass), of.chain);
    Words operands = load.words;  // with the memory operands
    operands[0] = of.vector;
    operands[1] = module_.newId();
    operands[2] = vector;
    align(operands, 3, of.vector);
    load = {kVectorExtractDynamic, {load.words[0], load.words[1], operands[1], of.index}};
    module_.functions.push_back({kLoad, std::move(operands)});
  }

  void changeChain(Words& words) {
    const std::uint32_t base = words[2];
    if (!types_.contains(base) && changed_.contains(base) && !groupCounts_.contains(base)) {
      if (words.size() != 4 || valueOf(words[3]) != 0)
        refuse(fmt::format("it reads more than the x of {}", nameOf(base)));
      if (base != groupCount_) return;
      words[0] = pointerTo(unsignedType(), kPrivateClass);
      groupCounts_.insert(words[1]);
      changed_.insert(words[1]);
      return;
    }
    const std::uint32_t type = usePointer(words[2]);
    if (type == 0) return;
    types_[words[1]] = words[0];
    changed_.insert(words[1]);
    std::uint32_t parent = pointees_.at(type);
    for (std::size_t i = 3; i + 1 < words.size(); ++i) parent = typeAt(parent, words[i]);
    if (words.size() > 3 && definition(parent).operation == kTypeVector)
      components_[words[1]] = {{words.begin() + 2, words.end() - 1}, parent, words.back()};
  }

  void changeLength(Instruction& instruction) {
    const auto variable = variables_.find(instruction.words[2]);
    if (variable == variables_.end())
      refuse(fmt::format("it asks for the length of {}", nameOf(instruction.words[2])));
    variable->second.used = true;
    std::uint32_t& length = variable->second.length;
    if (length == 0) length = addVariable(unsignedType(), kPrivateClass);
    instruction = {kLoad, {instruction.words[0], instruction.words[1], length}};
  }

  std::uint32_t texelsOf(std::uint32_t image) const {
    const auto known = texels_.find(image);
    if (known == texels_.end()) refuse(fmt::format("{} is an image of an unknown variable", nameOf(image)));
    return known->second;
  }

  void changeFetch(Instruction& instruction) {
    const Words& words = instruction.words;
    if (words.size() != 4) refuse("a fetch of a texel has image operands");
    if (words[0] != texelType()) refuse("a fetch of a texel gives no vec4");
    const std::uint32_t pointer = pointerTo(words[0], kPhysicalStorageBufferClass);
    const std::uint32_t texel = emit(kAccessChain, pointer, {texelsOf(words[2]), constant(0), words[3]});
    instruction = {kLoad, {words[0], words[1], texel, kAlignedBit, kTexelStride}};
  }

  // Memory of images is memory of buffers now.
  void checkSemantics(std::uint32_t semantics) const {
    if (!hasImages_) return;
    const std::uint32_t kinds = valueOf(semantics);
    if ((kinds & kImageMemoryBit) != 0 && (kinds & kUniformMemoryBit) == 0)
      refuse("a barrier orders images but not buffers");
  }

  // The entry function.

  Instruction& entryPoint() {
    const auto isEntryPoint = [](const Instruction& of) { return of.operation == kEntryPoint; };
    const auto found = std::ranges::find_if(module_.preamble, isEntryPoint);
    if (found == module_.preamble.end()) refuse("it has no entry point");
    if (std::ranges::count_if(module_.preamble, isEntryPoint) > 1) refuse("it has several entry points");
    return *found;
  }

  // Reads what a chain of members leads to.
  std::uint32_t read(std::uint32_t type, std::uint32_t base, const Words& members, std::uint32_t storage) {
    Words operands{base};
    operands.insert(operands.end(), members.begin(), members.end());
    const std::uint32_t chain = emit(kAccessChain, pointerTo(type, storage), operands);
    if (storage != kPhysicalStorageBufferClass) return emit(kLoad, type, {chain});
    return emit(kLoad, type, {chain, kAlignedBit, alignmentOf(type)});
  }
  std::uint32_t readMember(const Member& member, std::span<const Member> members, std::uint32_t base,
                           Words path = {}) {
    const auto isIt = [&](const Member& one) { return one.offset == member.offset; };
    const auto at = std::ranges::find_if(members, isIt) - members.begin();
    path.push_back(constant(static_cast<std::uint32_t>(at)));
    return read(member.type, base, path, kPhysicalStorageBufferClass);
  }

  void store(std::uint32_t variable, std::uint32_t value) {
    module_.functions.push_back({kStore, {variable, value}});
  }

  std::uint32_t bindingOf(std::uint32_t id) const {
    if (!isDecorated(id, kBinding) || decoration(id, kDescriptorSet) != 0)
      refuse(fmt::format("{} has no binding in set 0", nameOf(id)));
    return decoration(id, kBinding);
  }

  // Address and length of a buffer in the record.
  Member addressOf(std::uint32_t id) const {
    return {variables_.at(id).type, static_cast<std::uint32_t>(addressInRecord(bindingOf(id)))};
  }
  Member bytesOf(std::uint32_t id, std::size_t bindings) {
    return {unsignedType(), static_cast<std::uint32_t>(bytesInRecord(bindings, bindingOf(id)))};
  }

  // The members of the record that the kernel uses.
  std::vector<Member> membersOfRecord(std::size_t bindings) {
    std::vector<Member> addresses, lengths;
    std::set<std::uint32_t> numbers;
    for (const auto& [id, variable] : variables_) {
      if (!variable.used || variable.storage == kPushConstantClass) continue;
      const std::uint32_t number = bindingOf(id);
      if (number >= bindings) refuse(fmt::format("binding {} is not known to be used", number));
      if (!numbers.insert(number).second) refuse(fmt::format("two variables have binding {}", number));
      addresses.push_back(addressOf(id));
      if (variable.length != 0) lengths.push_back(bytesOf(id, bindings));
    }
    addresses.insert(addresses.end(), lengths.begin(), lengths.end());
    return addresses;
  }

  // Returns the new entry function.
  std::uint32_t addEntry(std::size_t bindings) {
    const std::uint32_t main = entryPoint().words[1];
    const std::uint32_t number = unsignedType(), vector = typeOf(kTypeVector, {number, 3}),
                        nothing = typeOf(kTypeVoid, {}), truth = typeOf(kTypeBool, {});
    const std::vector<Member> recordMembers = membersOfRecord(bindings);
    std::vector<Member> members;
    const auto push = std::ranges::find_if(variables_, [](const auto& one) {
      return one.second.used && one.second.storage == kPushConstantClass;
    });
    Member record{0, 0}, pushed{0, kAddressBytes};
    const Member groups{number, 2 * kAddressBytes};
    if (!recordMembers.empty()) {
      record.type = pointerTo(addInput(recordMembers), kPhysicalStorageBufferClass);
      members.push_back(record);
    }
    if (push != variables_.end()) {
      pushed.type = push->second.type;
      members.push_back(pushed);
    }
    members.push_back(groups);
    const std::uint32_t entries =
        pointerTo(addArrayBlock(addInput(members, false), sizeof(SharedEntry)), kPhysicalStorageBufferClass);
    const std::uint32_t root = addStructure(std::vector<Member>{{entries, 0}});
    annotate({root, kBlock});
    const std::uint32_t rootVariable = addVariable(root, kPushConstantClass);
    if (workgroup_ == 0) {
      workgroup_ = addVariable(vector, kInputClass);
      annotate({workgroup_, kBuiltIn, kWorkgroupId});
    }

    const std::uint32_t work = module_.newId(), end = module_.newId();
    const std::uint32_t function = emit(kFunction, nothing, {0, typeOf(kTypeFunction, {nothing})});
    module_.functions.push_back({kLabel, {module_.newId()}});
    const std::uint32_t base = read(entries, rootVariable, {constant(0)}, kPushConstantClass);
    const std::uint32_t x = read(number, workgroup_, {constant(0)}, kInputClass),
                        y = read(number, workgroup_, {constant(1)}, kInputClass);
    const Words entry{constant(0), y};
    const std::uint32_t count = readMember(groups, members, base, entry);
    const std::uint32_t runs = emit(kULessThan, truth, {x, count});
    module_.functions.push_back({kSelectionMerge, {end, 0}});
    module_.functions.push_back({kBranchConditional, {runs, work, end}});
    module_.functions.push_back({kLabel, {work}});
    if (groupCount_ != 0)
      store(groupCount_, emit(kCompositeConstruct, vector, {count, constant(1), constant(1)}));
    if (push != variables_.end()) store(push->first, readMember(pushed, members, base, entry));
    if (!recordMembers.empty()) setBuffers(readMember(record, members, base, entry), recordMembers, bindings);
    emit(kFunctionCall, nothing, {main});
    module_.functions.push_back({kBranch, {end}});
    module_.functions.push_back({kLabel, {end}});
    module_.functions.push_back({kReturn, {}});
    module_.functions.push_back({kFunctionEnd, {}});
    return function;
  }

  // Sets the variables of buffers, and those of their lengths.
  void setBuffers(std::uint32_t record, std::span<const Member> members, std::size_t bindings) {
    for (const auto& [id, variable] : variables_) {
      if (!variable.used || variable.storage == kPushConstantClass) continue;
      store(id, readMember(addressOf(id), members, record));
      if (variable.length == 0) continue;
      const std::uint32_t block = pointees_.at(variable.type), number = unsignedType();
      const Words& types = definition(block).words;  // after the identifier; the array is the last
      const std::uint32_t bytes = readMember(bytesOf(id, bindings), members, record);
      const std::uint32_t offset = offsetOf(block, static_cast<std::uint32_t>(types.size() - 2));
      const std::uint32_t ofArray = emit(kISub, number, {bytes, constant(offset)});
      const std::uint32_t stride = constant(decoration(types.back(), kArrayStride));
      store(variable.length, emit(kUDiv, number, {ofArray, stride}));
    }
  }

  void changePreamble(std::uint32_t entry) {
    std::uint32_t& main = entryPoint().words[1];
    for (auto& [operation, words] : module_.preamble) {
      if (operation == kMemoryModel) {
        if (words[0] != 0) refuse(fmt::format("its addressing model is {}", words[0]));
        words[0] = kPhysicalStorageBuffer64;
      }
      if ((operation == kExecutionMode || operation == kExecutionModeId) && words[0] == main)
        words[0] = entry;
    }
    main = entry;
    Words& interface = entryPoint().words;
    interface.insert(interface.end(), added_.begin(), added_.end());
    std::erase_if(module_.preamble, [&](const Instruction& instruction) {
      const auto& [operation, words] = instruction;
      if (operation == kCapability) return words[0] == kSampledBuffer || words[0] == kImageBuffer;
      return operation == kName && (images_.contains(words[0]) || texels_.contains(words[0]));
    });
    module_.preamble.insert(module_.preamble.begin(), {kCapability, {kPhysicalStorageBufferAddresses}});
  }

  SpirvModule module_;
  std::map<std::uint32_t, Instruction> definitions_;  // of types, constants and variables of the module
  std::map<std::uint32_t, std::map<std::uint32_t, std::uint32_t>> decorations_;  // in the kernel
  std::map<std::uint32_t, Variable> variables_;                                  // that become addresses
  std::map<std::uint32_t, std::uint32_t> pointees_;  // of the types of pointers that become addresses
  std::map<std::uint32_t, std::uint32_t> types_;     // of values and variables that become addresses
  std::map<std::uint32_t, Component> components_;    // pointers in functions
  std::map<std::uint32_t, std::uint32_t> texels_;    // loaded images, and the addresses of their texels
  std::set<std::uint32_t> images_;                   // types
  std::set<std::uint32_t> groupCounts_;              // pointers into gl_NumWorkGroups
  std::set<std::uint32_t> changed_;   // everything that an instruction may use only in the ways known here
  std::vector<std::uint32_t> added_;  // variables
  std::uint32_t groupCount_ = 0, workgroup_ = 0;  // gl_NumWorkGroups and gl_WorkGroupID
  bool hasImages_ = false;                        // images that are read without sampling
};

}  // namespace

std::vector<std::uint32_t> sharedCode(std::span<const std::uint32_t> spirv) {
  return SharedForm(spirv).spirv();
}

}  // namespace clothstream::vulkan
