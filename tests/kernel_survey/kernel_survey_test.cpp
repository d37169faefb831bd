// SPDX-License-Identifier: MIT
// Every kernel compiles for two generations of GPUs, spills no register, and is no worse than recorded.
// Mesa's RADV compiles without a GPU.
#include <algorithm>
#include <cstdlib>
#include <filesystem>
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
#include "tests/kernel_survey/figures.h"
#include "tests/kernel_survey/roofline.h"
#include "tests/kernel_survey/survey.h"
#include "tests/kernel_survey/survey_scenes.h"
#include "tests/simulation/all_kernels.h"

namespace clothstream::kernel_survey {
namespace {

using ::testing::ElementsAre;
using ::testing::Gt;
using ::testing::IsEmpty;
using ::testing::Optional;

constexpr const char* kFamily = "RADV_FORCE_FAMILY";
constexpr const char* kUpdate = "CLOTHSTREAM_UPDATE_FIGURES";

// A GPU that RADV compiles for, with the kernels of all scenes.
struct CompiledGpu {
  std::string driver;
  std::vector<SurveyedKernel> kernels;
};

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
const std::optional<CompiledGpu>& compiledFor(const std::string& gpu) {
  static std::map<std::string, std::optional<CompiledGpu>> all;
  const auto [known, isNew] = all.try_emplace(gpu);
  if (!isNew) return known->second;
  const std::vector<std::string>& names = kFamilies.at(gpu);
  const auto family = std::ranges::find_if(names, isOffered);
  if (family == names.end()) return known->second;
  setenv(kFamily, family->c_str(), 1);  // Mesa reads it when devices are listed
  vulkan::Device device({.select = deviceOf(*family), .compileOnly = true});
  unsetenv(kFamily);
  known->second = {device.info().driver, survey(device, surveyScenes())};
  return known->second;
}

std::filesystem::path figuresOf(const std::string& family) {
  return std::filesystem::path("tests/kernel_survey/figures") / (family + ".tsv");
}

class KernelSurvey : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (!compiledFor(GetParam()))
      GTEST_SKIP() << "RADV does not offer " << GetParam() << " here; Debian's mesa-vulkan-drivers does";
  }
  static const CompiledGpu& gpu() { return *compiledFor(GetParam()); }
};

TEST_P(KernelSurvey, CompilesEveryKernelOfTheServer) {
  std::set<std::string> compiled, all;
  for (const SurveyedKernel& kernel : gpu().kernels) compiled.insert(kernel.kernel);
  for (const vulkan::KernelCode& kernel : tests::kAllKernels) all.insert(kernel.name);
  EXPECT_EQ(compiled, all);
}

TEST_P(KernelSurvey, SpillsNoRegister) {
  for (const SurveyedKernel& kernel : gpu().kernels)
    for (const char* statistic : {"Spilled SGPRs", "Spilled VGPRs", "Scratch size"})
      EXPECT_THAT(kernel.statistic(statistic), Optional(0))
          << kernel.kernel << " [" << kernel.settings << "] " << statistic;
}

TEST_P(KernelSurvey, MatchesTheRecordedFigures) {
  const std::filesystem::path path = figuresOf(GetParam());
  const FigureTable now = tableOf(gpu().kernels, gpu().driver);
  if (const char* update = std::getenv(kUpdate); update != nullptr && *update == '1') {
    writeTable(path, now);
    return;
  }
  const FigureTable recorded = readTable(path);
  if (recorded.driver != now.driver)
    GTEST_SKIP() << path << " is of " << recorded.driver << ", and this is " << now.driver
                 << "; figures of different compilers are not compared";
  for (const std::string& difference : differences(recorded, now))
    ADD_FAILURE() << difference << ". If this is intended, record it: " << kUpdate
                  << "=1 build/release/bin/test_kernel_survey";
}

TEST_P(KernelSurvey, BoundsTheKernelsOfLargeCloths) {
  const auto& kernels = gpu().kernels;
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

TEST(FigureTables, NameTheKernelsThatDiffer) {
  const FigureTable recorded{"driver", {{"same", {8, 0, 32, 10}}, {"slower", {8, 0, 32, 10}}, {"gone", {}}}};
  const FigureTable now{"driver",
                        {{"same", {8, 0, 32, 10}}, {"slower", {8, 0, 32, 11}}, {"extra", {16, 0, 32, 10}}}};
  EXPECT_THAT(differences(recorded, now),
              ElementsAre("extra is new: 16 registers, 0 shared bytes, 32 subgroups, 10 instructions",
                          "slower is worse: 8 registers, 0 shared bytes, 32 subgroups, 11 instructions, "
                          "recorded 8 registers, 0 shared bytes, 32 subgroups, 10 instructions",
                          "gone no longer exists"));
  EXPECT_THAT(differences(now, now), IsEmpty());
}

TEST(FigureTables, AreReadAsTheyWereWritten) {
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / "figures.tsv";
  const FigureTable table{"driver 1", {{"one [A, B 2] 64", {8, 0, 32, 10}}, {"two [] 8", {1, 2, 3, 4}}}};
  writeTable(path, table);
  const FigureTable read = readTable(path);
  EXPECT_EQ(read.driver, table.driver);
  EXPECT_EQ(read.kernels, table.kernels);
  std::filesystem::remove(path);
  EXPECT_THROW(readTable(path), std::runtime_error);
}

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
