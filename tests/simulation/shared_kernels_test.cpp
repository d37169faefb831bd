// SPDX-License-Identifier: MIT
// Every kernel of the server has a valid shared form with the same arithmetic.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/vulkan/shared_code.h"
#include "server/vulkan/spirv_module.h"
#include "server/vulkan/spirv_names.h"
#include "tests/simulation/all_kernels.h"

namespace clothstream::tests {
namespace {

using vulkan::Instruction;
using vulkan::SpirvModule;

// Runs the validator, which prints what is wrong to the standard error.
bool isValid(const std::vector<std::uint32_t>& spirv) {
  std::FILE* validator = popen(CLOTHSTREAM_SPIRV_VAL " --target-env vulkan1.2 -", "w");
  if (validator == nullptr) return false;
  const std::size_t written = std::fwrite(spirv.data(), sizeof(std::uint32_t), spirv.size(), validator);
  return pclose(validator) == 0 && written == spirv.size();
}

// Conversions, arithmetic and comparisons in their order, and extended instructions.
std::vector<Instruction> arithmeticOf(const SpirvModule& module) {
  constexpr std::uint32_t kFirst = 109, kLast = 215;
  std::vector<Instruction> found;
  for (const Instruction& one : module.functions)
    if (one.operation == vulkan::spirv::kExtInst || (one.operation >= kFirst && one.operation <= kLast))
      found.push_back(one);
  return found;
}

std::vector<Instruction> uncontractedIn(const SpirvModule& module) {
  constexpr std::uint32_t kNoContraction = 42;
  std::vector<Instruction> found;
  for (const Instruction& one : module.annotations)
    if (one.operation == vulkan::spirv::kDecorate && one.words[1] == kNoContraction) found.push_back(one);
  return found;
}

class SharedKernels : public ::testing::TestWithParam<vulkan::KernelCode> {};

TEST_P(SharedKernels, AreValid) {
  EXPECT_TRUE(isValid(vulkan::sharedCode(GetParam().spirv)));
}

TEST_P(SharedKernels, KeepTheArithmetic) {
  const SpirvModule kernel(GetParam().spirv), shared(vulkan::sharedCode(GetParam().spirv));
  const std::vector<Instruction> own = arithmeticOf(kernel);
  std::vector<Instruction> kept = arithmeticOf(shared);
  ASSERT_GE(kept.size(), own.size());
  kept.resize(own.size());  // the new entry function is the last
  EXPECT_TRUE(own == kept);
  EXPECT_TRUE(uncontractedIn(kernel) == uncontractedIn(shared));
}

INSTANTIATE_TEST_SUITE_P(All, SharedKernels, ::testing::ValuesIn(kAllKernels),
                         [](const auto& kernel) { return std::string(kernel.param.name); });

TEST(SharedKernelsCheck, FindsAnInvalidModule) {
  std::vector<std::uint32_t> spirv = vulkan::sharedCode(kAllKernels[0].spirv);
  spirv.resize(spirv.size() - 1);  // without the end of the last function
  EXPECT_FALSE(isValid(spirv));
}

}  // namespace
}  // namespace clothstream::tests
