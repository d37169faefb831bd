// SPDX-License-Identifier: MIT
// The arithmetic that gives the same bits everywhere: its error, and that kernels use nothing else.
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "kernels/advance_mass_spring.h"
#include "kernels/compute_normals.h"
#include "kernels/evaluate_reciprocal_square_root.h"
#include "kernels/fill_jacobian.h"
#include "kernels/multiply_jacobians.h"
#include "kernels/solve_multipliers.h"
#include "server/vulkan/kernel.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::tests {
namespace {

constexpr double kReciprocalSquareRootError = 7e-7;

class Arithmetic : public GpuTest {
 protected:
  // Largest relative error over `count` floats from the one with bits `first`, `stride` patterns apart.
  static double largestError(std::uint32_t first, std::uint32_t stride, std::uint32_t count) {
    struct Push {
      std::uint32_t first, stride;
    };
    constexpr std::uint32_t kSlice = 1u << 21;
    const vulkan::Kernel kernel(device(), {.name = "evaluate_reciprocal_square_root",
                                           .spirv = kernels::evaluate_reciprocal_square_root,
                                           .bindings = {vulkan::BindingKind::storage},
                                           .pushConstantBytes = sizeof(Push),
                                           .workgroupSize = 64,
                                           .specialisation = {}});
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

// The exponent is halved exactly, so that the error repeats every two binades: these are all there are.
TEST_F(Arithmetic, ReciprocalSquareRootKeepsItsErrorBoundForEveryFloatFromOneToFour) {
  EXPECT_LT(largestError(std::bit_cast<std::uint32_t>(1.0f), 1, 1u << 24), kReciprocalSquareRootError);
}

TEST_F(Arithmetic, ReciprocalSquareRootKeepsItsErrorBoundAtEveryMagnitude) {
  const std::uint32_t smallest = 0x00800000, largest = 0x7F7FFFFF, stride = 997;
  EXPECT_LT(largestError(smallest, stride, (largest - smallest) / stride), kReciprocalSquareRootError);
}

// What a SPIR-V module says of its float arithmetic.
struct FloatArithmetic {
  std::map<std::string, int> operations;  // by name
  int contractible = 0;                   // operations without NoContraction
  std::set<std::uint32_t> extended;       // GLSL.std.450 instructions
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
        if (!uncontracted.contains(spirv[at + 2])) ++found.contractible;
      }
    }
  return found;
}

void expectExact(std::span<const std::uint32_t> spirv) {
  const FloatArithmetic found = floatArithmeticOf(spirv);
  EXPECT_GT(found.operations.at("FMul"), 5);
  EXPECT_EQ(found.contractible, 0);
  for (const auto& [name, count] : found.operations)
    EXPECT_TRUE(name == "FAdd" || name == "FSub" || name == "FMul" || name == "FNegate" ||
                name == "VectorTimesScalar")
        << name << " " << count;
  constexpr std::uint32_t kFAbs = 4, kUMin = 38, kFMax = 40;
  for (const std::uint32_t instruction : found.extended)
    EXPECT_TRUE(instruction == kFAbs || instruction == kUMin || instruction == kFMax)
        << "GLSL.std.450 instruction " << instruction;
}

TEST(KernelArithmetic, AdvanceAddsSubtractsAndMultipliesWithoutContraction) {
  expectExact(kernels::advance_mass_spring);
}

TEST(KernelArithmetic, NormalsAddSubtractAndMultiplyWithoutContraction) {
  expectExact(kernels::compute_normals);
}

TEST(KernelArithmetic, AssemblyAddsSubtractsAndMultipliesWithoutContraction) {
  expectExact(kernels::fill_jacobian);
  expectExact(kernels::multiply_jacobians);
  expectExact(kernels::solve_multipliers);
}

}  // namespace
}  // namespace clothstream::tests
