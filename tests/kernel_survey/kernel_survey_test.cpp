// SPDX-License-Identifier: MIT
// Every kernel compiles for two generations of GPUs, and spills no register.
// Mesa's RADV compiles without a GPU.
#include <algorithm>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/vulkan/device.h"
#include "server/vulkan/kernel_statistics.h"
#include "tests/kernel_survey/roofline.h"
#include "tests/kernel_survey/survey.h"
#include "tests/kernel_survey/survey_scenes.h"
#include "tests/simulation/all_kernels.h"

namespace clothstream::kernel_survey {
namespace {

using ::testing::Gt;
using ::testing::IsEmpty;
using ::testing::Optional;

constexpr const char* kFamily = "RADV_FORCE_FAMILY";

// Kernels of all scenes.
using Kernels = std::vector<SurveyedKernel>;

// Names of a GPU in releases of Mesa, the oldest first.
const std::map<std::string, std::vector<std::string>> kFamilies{{"NAVI21", {"NAVI21"}},
                                                                {"GFX1100", {"GFX1100", "NAVI31"}}};

std::string deviceOf(const std::string& family) {
  return "RADV " + family;
}

// True if RADV offers this family. A child process asks, because RADV ends a process with a family that it
// does not know.
bool isOffered(const std::string& family) {
  const pid_t child = fork();
  if (child == 0) {
    setenv(kFamily, family.c_str(), 1);
    try {
      const vulkan::Device device({.select = deviceOf(family), .compileOnly = true});
      _exit(0);
    } catch (...) {
      _exit(1);
    }
  }
  int status = 1;
  return child > 0 && waitpid(child, &status, 0) == child && status == 0;
}

// Compiles once per program. Empty if this machine has no RADV, or one without this GPU.
const std::optional<Kernels>& compiledFor(const std::string& gpu) {
  static std::map<std::string, std::optional<Kernels>> all;
  const auto [known, isNew] = all.try_emplace(gpu);
  if (!isNew) return known->second;
  const std::vector<std::string>& names = kFamilies.at(gpu);
  const auto family = std::ranges::find_if(names, isOffered);
  if (family == names.end()) return known->second;
  setenv(kFamily, family->c_str(), 1);  // Mesa reads it when devices are listed
  vulkan::Device device({.select = deviceOf(*family), .compileOnly = true});
  unsetenv(kFamily);
  known->second = survey(device, surveyScenes());
  return known->second;
}

class KernelSurvey : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!compiledFor(GetParam()))
      GTEST_SKIP() << "RADV does not offer " << GetParam() << " here; Debian's mesa-vulkan-drivers does";
  }
  static const Kernels& kernels() { return *compiledFor(GetParam()); }
};

TEST_P(KernelSurvey, CompilesEveryKernelOfTheServer) {
  std::set<std::string> compiled, all;
  for (const SurveyedKernel& kernel : kernels()) compiled.insert(kernel.kernel);
  for (const vulkan::KernelCode& kernel : tests::kAllKernels) all.insert(kernel.name);
  EXPECT_EQ(compiled, all);
}

TEST_P(KernelSurvey, SpillsNoRegister) {
  for (const SurveyedKernel& kernel : kernels())
    for (const char* statistic : {"Spilled SGPRs", "Spilled VGPRs", "Scratch size"})
      EXPECT_THAT(kernel.statistic(statistic), Optional(0))
          << kernel.kernel << " [" << kernel.settings << "] " << statistic;
}

TEST_P(KernelSurvey, BoundsTheKernelsOfLargeCloths) {
  const Kernels& kernels = this->kernels();
  const auto advance = std::ranges::find_if(kernels, [](const SurveyedKernel& kernel) {
    return kernel.kernel == "advance_mass_spring" && kernel.bytesPerNode;
  });
  ASSERT_NE(advance, kernels.end());
  // A substep reads and writes position and velocity, 16 bytes each, and reads tiles. The marks of stretched
  // springs are bound too, 4 bytes.
  EXPECT_GE(*advance->bytesPerNode, 68);
  EXPECT_LT(*advance->bytesPerNode, 69);
  EXPECT_THAT(advance->invocationsPerNode, Optional(1));
  for (const Gpu& on : namedGpus()) {
    EXPECT_THAT(boundPerNode(*advance, on), Optional(Gt(64 / on.bytesPerSecond))) << on.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Gpus, KernelSurvey, ::testing::Values("NAVI21", "GFX1100"),
                         [](const auto& family) { return std::string(family.param); });

// Debian's software device does not tell statistics; it compiles all the same.
TEST(KernelStatistics, AreEmptyIfTheDriverTellsNothing) {
  try {
    vulkan::Device device({.select = "llvmpipe", .compileOnly = true});
    std::vector<SurveyScene> scenes = surveyScenes();
    scenes.resize(1);
    for (const SurveyedKernel& kernel : survey(device, scenes)) {
      EXPECT_THAT(kernel.statistics, IsEmpty()) << kernel.kernel;
      EXPECT_EQ(laneCyclesPerNode(kernel), std::nullopt);
    }
  } catch (const vulkan::DeviceError& error) {
    GTEST_SKIP() << error.what();
  }
}

}  // namespace
}  // namespace clothstream::kernel_survey
