// SPDX-License-Identifier: MIT
// The shared form of kernels: what replaces buffers, texels, lengths and push constants, and what is refused.
#include "server/vulkan/shared_code.h"

#include <algorithm>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "kernels/add_scaled.h"
#include "kernels/copy_by_length.h"
#include "kernels/count_up.h"
#include "kernels/do_nothing.h"
#include "kernels/gather_texels.h"
#include "kernels/number_rows.h"
#include "server/vulkan/spirv_interface.h"
#include "server/vulkan/spirv_module.h"
#include "server/vulkan/spirv_names.h"

namespace clothstream::vulkan {
namespace {

using ::testing::HasSubstr;

SpirvModule sharedFormOf(std::span<const std::uint32_t> kernel) {
  return SpirvModule(sharedCode(kernel));
}

std::size_t countOf(std::span<const Instruction> instructions, std::uint32_t operation) {
  const auto is = [&](const Instruction& one) { return one.operation == operation; };
  return static_cast<std::size_t>(std::ranges::count_if(instructions, is));
}

// Number of member decorations of this kind.
std::size_t membersWith(const SpirvModule& module, std::uint32_t decoration) {
  const auto is = [&](const Instruction& one) {
    return one.operation == spirv::kMemberDecorate && one.words[2] == decoration;
  };
  return static_cast<std::size_t>(std::ranges::count_if(module.annotations, is));
}

// Variables of this storage class.
std::size_t variablesIn(const SpirvModule& module, std::uint32_t storage) {
  const auto is = [&](const Instruction& one) {
    return one.operation == spirv::kVariable && one.words[2] == storage;
  };
  return static_cast<std::size_t>(std::ranges::count_if(module.globals, is));
}

std::string refusalOf(std::span<const std::uint32_t> kernel) {
  try {
    sharedCode(kernel);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "none";
}

// The kernel with another operation instead of this one.
std::vector<std::uint32_t> withOperation(std::span<const std::uint32_t> kernel, std::uint32_t instead,
                                         std::uint32_t operation) {
  SpirvModule module(kernel);
  for (Instruction& instruction : module.functions)
    if (instruction.operation == instead) instruction.operation = operation;
  return module.spirv();
}

TEST(SpirvModule, KeepsEveryWord) {
  const std::span<const std::uint32_t> kernel = kernels::copy_by_length.spirv;
  EXPECT_EQ(SpirvModule(kernel).spirv(), std::vector(kernel.begin(), kernel.end()));
}

TEST(SpirvModule, RefusesCutWords) {
  const std::span<const std::uint32_t> kernel = kernels::do_nothing.spirv;
  EXPECT_THROW(SpirvModule(kernel.first(4)), std::runtime_error);
  EXPECT_THROW(SpirvModule(kernel.first(6)), std::runtime_error);
}

TEST(SharedCode, HasNoBindings) {
  for (const KernelCode& kernel : {kernels::add_scaled, kernels::count_up, kernels::gather_texels}) {
    const SpirvInterface interface = interfaceOf(sharedCode(kernel.spirv));
    EXPECT_TRUE(interface.bindings.empty()) << kernel.name;
    EXPECT_EQ(interface.constants.size(), interfaceOf(kernel.spirv).constants.size());
  }
}

TEST(SharedCode, KeepsKernelsWithoutBuffers) {
  const SpirvModule shared = sharedFormOf(kernels::do_nothing.spirv);
  EXPECT_EQ(variablesIn(shared, spirv::kPrivateClass), 0u);
  EXPECT_EQ(variablesIn(shared, spirv::kPushConstantClass), 1u);
}

TEST(SharedCode, ReplacesPushConstants) {
  const SpirvModule shared = sharedFormOf(kernels::count_up.spirv);
  EXPECT_EQ(variablesIn(shared, spirv::kPushConstantClass), 1u);
  EXPECT_EQ(variablesIn(shared, spirv::kPrivateClass), 3u);  // push constants and two buffers
  EXPECT_EQ(variablesIn(shared, spirv::kStorageBufferClass), 0u);
}

TEST(SharedCode, ReadsTexelsFromMemory) {
  const SpirvModule shared = sharedFormOf(kernels::copy_by_length.spirv);
  EXPECT_EQ(countOf(shared.functions, spirv::kImageFetch), 0u);
  EXPECT_EQ(countOf(shared.functions, spirv::kImageRead), 0u);
  EXPECT_EQ(countOf(shared.globals, spirv::kTypeImage), 0u);
  EXPECT_EQ(membersWith(shared, spirv::kCoherent), 1u);  // of the two buffers of texels
  for (const Instruction& one : shared.preamble)
    if (one.operation == spirv::kCapability) {
      EXPECT_NE(one.words[0], spirv::kSampledBuffer);
      EXPECT_NE(one.words[0], spirv::kImageBuffer);
    }
}

TEST(SharedCode, ComputesLengthsOfArrays) {
  const SpirvModule shared = sharedFormOf(kernels::copy_by_length.spirv);
  EXPECT_EQ(countOf(shared.functions, spirv::kArrayLength), 0u);
  EXPECT_EQ(countOf(shared.functions, spirv::kISub), 1u);  // bytes of the other members
  EXPECT_EQ(countOf(shared.functions, spirv::kUDiv), 1u);
}

TEST(SharedCode, ChangesOnlyTheEntryPoint) {
  const SpirvModule kernel(kernels::add_scaled.spirv), shared = sharedFormOf(kernels::add_scaled.spirv);
  EXPECT_EQ(countOf(shared.functions, spirv::kFunction), countOf(kernel.functions, spirv::kFunction) + 1);
  EXPECT_EQ(countOf(shared.preamble, spirv::kEntryPoint), 1u);
  EXPECT_EQ(countOf(shared.preamble, spirv::kExecutionMode), countOf(kernel.preamble, spirv::kExecutionMode));
}

TEST(SharedCode, RefusesWhatReadsRows) {
  EXPECT_THAT(refusalOf(kernels::number_rows.spirv), HasSubstr("more than the x of gl_WorkGroupID"));
}

TEST(SharedCode, RefusesUnknownUsesOfBuffers) {
  const std::vector<std::uint32_t> unknown =
      withOperation(kernels::count_up.spirv, spirv::kAccessChain, spirv::kImageTexelPointer);
  EXPECT_THAT(refusalOf(unknown), HasSubstr("operation 60 uses"));
}

TEST(SharedCode, RefusesOldSpirv) {
  std::vector<std::uint32_t> old(kernels::add_scaled.spirv.begin(), kernels::add_scaled.spirv.end());
  old[1] = 0x00010300;
  EXPECT_THAT(refusalOf(old), HasSubstr("older than SPIR-V 1.5"));
}

TEST(SharedCode, RefusesOtherTexels) {
  SpirvModule module(kernels::gather_texels.spirv);
  for (Instruction& global : module.globals)
    if (global.operation == spirv::kTypeImage) global.words[2] = 1;  // two dimensions
  EXPECT_THAT(refusalOf(module.spirv()), HasSubstr("no buffer of RGBA32F texels"));
}

TEST(SharedCode, RecordHasAddressesAndBytes) {
  EXPECT_EQ(addressInRecord(2), 16u);
  EXPECT_EQ(bytesInRecord(3, 0), 24u);
  EXPECT_EQ(bytesInRecord(3, 2), 32u);
  EXPECT_EQ(bytesOfRecord(3), 36u);
}

}  // namespace
}  // namespace clothstream::vulkan
