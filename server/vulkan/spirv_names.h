// SPDX-License-Identifier: MIT
// Names of numbers in the SPIR-V specification (section 3), as far as this folder uses them.
#pragma once

#include <cstdint>

namespace clothstream::vulkan::spirv {

// Operations.
constexpr std::uint32_t kUndef = 1, kName = 5, kExtInst = 12, kMemoryModel = 14, kEntryPoint = 15,
                        kExecutionMode = 16, kCapability = 17, kTypeVoid = 19, kTypeBool = 20, kTypeInt = 21,
                        kTypeFloat = 22, kTypeVector = 23, kTypeMatrix = 24, kTypeImage = 25,
                        kTypeSampledImage = 27, kTypeArray = 28, kTypeRuntimeArray = 29, kTypeStruct = 30,
                        kTypePointer = 32, kTypeFunction = 33, kTypeForwardPointer = 39, kConstantTrue = 41,
                        kConstant = 43, kSpecConstantTrue = 48, kSpecConstantFalse = 49, kSpecConstant = 50,
                        kSpecConstantOp = 52, kFunction = 54, kFunctionParameter = 55, kFunctionEnd = 56,
                        kFunctionCall = 57, kVariable = 59, kImageTexelPointer = 60, kLoad = 61, kStore = 62,
                        kAccessChain = 65, kInBoundsAccessChain = 66, kArrayLength = 68, kDecorate = 71,
                        kMemberDecorate = 72, kDecorationGroup = 73, kGroupMemberDecorate = 75,
                        kVectorShuffle = 79, kCompositeConstruct = 80, kCompositeExtract = 81,
                        kCompositeInsert = 82, kImageFetch = 95, kImageRead = 98, kImage = 100, kUDiv = 134,
                        kISub = 130, kULessThan = 176, kControlBarrier = 224, kMemoryBarrier = 225,
                        kAtomicLoad = 227, kAtomicStore = 228, kAtomicXor = 242, kLoopMerge = 246,
                        kSelectionMerge = 247, kLabel = 248, kBranch = 249, kBranchConditional = 250,
                        kSwitch = 251, kReturn = 253, kExecutionModeId = 331, kDecorateId = 332,
                        kDecorateString = 5632, kMemberDecorateString = 5633;

// Decorations.
constexpr std::uint32_t kSpecId = 1, kBlock = 2, kArrayStride = 6, kBuiltIn = 11, kRestrict = 19,
                        kAliased = 20, kVolatile = 21, kCoherent = 23, kNonWritable = 24, kNonReadable = 25,
                        kBinding = 33, kDescriptorSet = 34, kOffset = 35, kRestrictPointer = 5355,
                        kAliasedPointer = 5356;

// Storage classes.
constexpr std::uint32_t kUniformConstantClass = 0, kInputClass = 1, kWorkgroupClass = 4, kPrivateClass = 6,
                        kPushConstantClass = 9, kStorageBufferClass = 12, kPhysicalStorageBufferClass = 5349;

// Built-in variables.
constexpr std::uint32_t kNumWorkgroups = 24, kWorkgroupId = 26, kGlobalInvocationId = 28;

// Capabilities and addressing models.
constexpr std::uint32_t kSampledBuffer = 46, kImageBuffer = 47, kPhysicalStorageBufferAddresses = 5347;
constexpr std::uint32_t kPhysicalStorageBuffer64 = 5348;

// Memory operands and memory semantics, as bits.
constexpr std::uint32_t kAlignedBit = 2;
constexpr std::uint32_t kUniformMemoryBit = 0x40, kImageMemoryBit = 0x800;

// Operands of kTypeImage.
constexpr std::uint32_t kBufferDimension = 5, kUsedWithSampler = 1, kRgba32f = 1;

}  // namespace clothstream::vulkan::spirv
