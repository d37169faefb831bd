// SPDX-License-Identifier: MIT
// The arithmetic that gives the same bits on every device: its error, and that kernels use no other
// arithmetic.
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "kernels/advance_mass_spring.h"
#include "kernels/evaluate_reciprocal_square_root.h"
#include "server/vulkan/kernel.h"
#include "tests/simulation/all_kernels.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {
namespace {

constexpr double kReciprocalSquareRootError = 7e-7;

class Arithmetic : public GpuTest {
 protected:
  // Largest relative error over `count` floats whose bits start at `first` and are `stride` apart.
  static double largestError(std::uint32_t first, std::uint32_t stride, std::uint32_t count) {
    struct Push {
      std::uint32_t first, stride;
    };
    constexpr std::uint32_t kSlice = 1u << 21;
    const vulkan::Kernel kernel(device(), kernels::evaluate_reciprocal_square_root, 64);
    const vulkan::Buffer results(device(), vulkan::BufferPurpose::readback, kSlice * sizeof(float));
    const vulkan::Bindings bindings(device(), kernel, {&results});
    double largest = 0;
    for (std::uint32_t done = 0; done < count; done += kSlice) {
      const Push push{first + done * stride, stride};
      run([&](vulkan::Recorder& recorder) { recorder.dispatch(bindings, push, kSlice); });
      const std::span<const float> values = results.mapped<const float>();
      for (std::uint32_t i = 0; i < std::min(kSlice, count - done); ++i) {
        const double x = std::bit_cast<float>(push.first + i * stride);
        largest = std::max(largest, std::abs(double{values[i]} * std::sqrt(x) - 1));
      }
    }
    return largest;
  }
};

// The exponent is halved exactly, so that the error repeats every two binades. This test covers all of them.
TEST_F(Arithmetic, KeepsErrorBoundOfReciprocalSquareRootFromOneToFour) {
  EXPECT_LT(largestError(std::bit_cast<std::uint32_t>(1.0f), 1, 1u << 24), kReciprocalSquareRootError);
}

TEST_F(Arithmetic, KeepsErrorBoundOfReciprocalSquareRootAtEveryMagnitude) {
  const std::uint32_t smallest = 0x00800000, largest = 0x7F7FFFFF, stride = 997;
  EXPECT_LT(largestError(smallest, stride, (largest - smallest) / stride), kReciprocalSquareRootError);
}

// Float arithmetic of a SPIR-V module.
struct FloatArithmetic {
  std::map<std::string, int> operations;    // by name
  std::map<std::string, int> contractible;  // operations without NoContraction, by name
  std::set<std::uint32_t> extended;         // GLSL.std.450 instructions
};

FloatArithmetic floatArithmeticOf(std::span<const std::uint32_t> spirv) {
  constexpr std::uint32_t kDecorate = 71, kExtInst = 12, kNoContraction = 42;
  const std::map<std::uint32_t, std::string> names{{127, "FNegate"},
                                                   {129, "FAdd"},
                                                   {131, "FSub"},
                                                   {133, "FMul"},
                                                   {136, "FDiv"},
                                                   {140, "FRem"},
                                                   {141, "FMod"},
                                                   {142, "VectorTimesScalar"},
                                                   {143, "MatrixTimesScalar"},
                                                   {144, "VectorTimesMatrix"},
                                                   {145, "MatrixTimesVector"},
                                                   {146, "MatrixTimesMatrix"},
                                                   {147, "OuterProduct"},
                                                   {148, "Dot"}};
  FloatArithmetic found;
  std::set<std::uint32_t> uncontracted;
  for (int pass = 0; pass < 2; ++pass)
    for (std::size_t at = 5; at < spirv.size(); at += spirv[at] >> 16) {
      const std::uint32_t operation = spirv[at] & 0xFFFF;
      if (pass == 0) {
        if (operation == kDecorate && spirv[at + 2] == kNoContraction) uncontracted.insert(spirv[at + 1]);
        if (operation == kExtInst) found.extended.insert(spirv[at + 4]);
      } else if (const auto name = names.find(operation); name != names.end()) {
        ++found.operations[name->second];
        if (!uncontracted.contains(spirv[at + 2])) ++found.contractible[name->second];
      }
    }
  return found;
}

// GLSL.std.450 instructions whose result Vulkan fixes exactly.
const std::set<std::uint32_t> kExactInstructions{
    2,           // RoundEven
    4,  5,       // FAbs, SAbs
    8,           // Floor
    37, 38, 39,  // FMin, UMin, SMin
    40, 41, 42,  // FMax, UMax, SMax
    43, 44, 45,  // FClamp, UClamp, SClamp
    73, 74, 75,  // FindILsb, FindSMsb, FindUMsb
};

// Kernels that call inversesqrt, whose rounding may differ between devices. surface_frame.glsl only starts an
// integer search with it; the result of the search is exact.
constexpr std::uint32_t kInverseSqrt = 32;
const std::set<std::string> kKernelsThatEstimate{"predict_phase", "predict_small_phases", "sum_products"};

class KernelArithmetic : public ::testing::TestWithParam<vulkan::KernelCode> {};

TEST_P(KernelArithmetic, UsesOnlyOperationsWithTheSameBitsOnEveryDevice) {
  const FloatArithmetic found = floatArithmeticOf(GetParam().spirv);
  EXPECT_THAT(found.contractible, ::testing::IsEmpty()) << "declare the variables `precise`";
  for (const auto& [name, count] : found.operations)
    EXPECT_TRUE(name == "FAdd" || name == "FSub" || name == "FMul" || name == "FNegate" ||
                name == "VectorTimesScalar")
        << name << " " << count;
  const bool estimates = kKernelsThatEstimate.contains(GetParam().name);
  EXPECT_EQ(found.extended.contains(kInverseSqrt), estimates);
  for (const std::uint32_t instruction : found.extended)
    EXPECT_TRUE(kExactInstructions.contains(instruction) || (estimates && instruction == kInverseSqrt))
        << "GLSL.std.450 instruction " << instruction;
}

INSTANTIATE_TEST_SUITE_P(All, KernelArithmetic, ::testing::ValuesIn(kAllKernels),
                         [](const auto& kernel) { return std::string(kernel.param.name); });

TEST(KernelArithmeticCheck, SeesTheArithmeticOfKernels) {
  const FloatArithmetic found = floatArithmeticOf(kernels::advance_mass_spring.spirv);
  EXPECT_GT(found.operations.at("FMul"), 5);
  EXPECT_GE(std::size(kAllKernels), 48u);
}

TEST(KernelArithmeticCheck, FindsAContractibleOperation) {
  // A header, and one FAdd without decoration: result type 1, result 2, operands 3 and 4.
  const std::vector<std::uint32_t> spirv{0x07230203, 0x00010500, 0, 5, 0, 5u << 16 | 129, 1, 2, 3, 4};
  EXPECT_EQ(floatArithmeticOf(spirv).contractible.at("FAdd"), 1);
}

}  // namespace
}  // namespace clothstream::tests
