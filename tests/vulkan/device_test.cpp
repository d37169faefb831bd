// SPDX-License-Identifier: MIT
// Finding, choosing and opening devices; waiting for them.
#include "server/vulkan/device.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <thread>

#include <gmock/gmock.h>

#include "server/vulkan/handles.h"
#include "server/vulkan/instance.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::vulkan {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Sets or removes an environment variable. The destructor restores the old value.
class Environment {
 public:
  Environment(const char* name, const std::optional<std::string>& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    put(value);
  }
  ~Environment() { put(before_); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  void put(const std::optional<std::string>& value) const {
    if (value)
      setenv(name_, value->c_str(), 1);
    else
      unsetenv(name_);
  }

  const char* name_;
  std::optional<std::string> before_;
};

std::string errorOf(const DeviceOptions& options) {
  try {
    const Device device(options);
  } catch (const DeviceError& error) {
    return error.what();
  }
  return {};
}

Candidate candidate(const char* name, DeviceKind kind) {
  return {.info = {.name = name, .kind = kind}, .physical = nullptr};
}

std::size_t threadsRunning() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return static_cast<std::size_t>(std::distance(begin(tasks), end(tasks)));
}

// Number of threads that a device with these options adds to this process. The kernel lists a joined thread
// for a moment, so the function waits until the count is back at its first value.
std::size_t threadsAddedBy(const DeviceOptions& options) {
  const std::size_t before = threadsRunning();
  std::size_t during = 0;
  {
    const Device device(options);
    during = threadsRunning();
  }
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (threadsRunning() != before && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
  EXPECT_EQ(threadsRunning(), before);
  return during - before;
}

using DeviceTest = tests::GpuTest;

TEST_F(DeviceTest, ListedDevicesAreNumberedFromTheBestOn) {
  const std::vector<DeviceInfo> devices = listDevices();
  ASSERT_THAT(devices, Not(IsEmpty()));
  for (std::uint32_t i = 0; i < devices.size(); ++i) {
    EXPECT_EQ(devices[i].index, i);
    EXPECT_THAT(devices[i].name, Not(IsEmpty()));
    EXPECT_THAT(devices[i].driver, Not(IsEmpty()));
    EXPECT_GE(devices[i].apiVersion, "1.2");
    EXPECT_LE(devices[i > 0 ? i - 1 : 0].kind, devices[i].kind);
  }
}

TEST_F(DeviceTest, OpensTheBestDeviceByDefault) {
  const std::vector<DeviceInfo> devices = listDevices();
  EXPECT_EQ(Device().info().name, devices.front().name);
  EXPECT_EQ(Device({.select = "0"}).info().name, devices.front().name);
  const std::uint32_t last = devices.back().index;
  EXPECT_EQ(Device({.select = std::to_string(last)}).info().index, last);
}

TEST_F(DeviceTest, ReportsLimitsAtLeastAsLargeAsVulkanDemands) {
  const Limits& limits = tests::device().limits();
  EXPECT_GE(limits.maxWorkgroupInvocations, 128u);
  EXPECT_GE(limits.maxWorkgroupSizeX, 128u);
  EXPECT_GE(limits.maxDispatchX, 65535u);
  EXPECT_GE(limits.maxSharedBytes, 16384u);
  EXPECT_GE(limits.maxStorageRange, 1u << 27);
  EXPECT_GE(limits.maxTexelElements, 65536u);
  EXPECT_GE(limits.maxPushConstantBytes, 128u);
  EXPECT_GE(limits.subgroupSize, 1u);
  EXPECT_GT(limits.deviceMemoryBytes, 0u);
}

TEST(DeviceSelection, RanksDiscreteBeforeIntegratedBeforeVirtualBeforeSoftware) {
  std::vector<Candidate> all;
  all.push_back(candidate("other", DeviceKind::other));
  all.push_back(candidate("software", DeviceKind::software));
  all.push_back(candidate("virtual", DeviceKind::virtualGpu));
  all.push_back(candidate("integrated", DeviceKind::integrated));
  all.push_back(candidate("discrete a", DeviceKind::discrete));
  all.push_back(candidate("discrete b", DeviceKind::discrete));
  rank(all);
  std::vector<std::string> names;
  for (const Candidate& each : all) names.push_back(each.info.name);
  EXPECT_THAT(names, ::testing::ElementsAre("discrete a", "discrete b", "integrated", "virtual", "software",
                                            "other"));
  EXPECT_EQ(all.back().info.index, 5u);
}

TEST(DeviceSelection, TakesAnIndexOrAPartOfANameInAnyCase) {
  std::vector<Candidate> all;
  all.push_back(candidate("GeForce RTX 4090", DeviceKind::discrete));
  all.push_back(candidate("AMD Radeon", DeviceKind::integrated));
  rank(all);
  EXPECT_EQ(select(all, ""), 0u);
  EXPECT_EQ(select(all, "1"), 1u);
  EXPECT_EQ(select(all, "radeon"), 1u);
  EXPECT_EQ(select(all, "rtx 40"), 0u);
}

TEST_F(DeviceTest, RefusesAnUnknownSelectionAndListsTheDevices) {
  const std::string there = tests::device().info().name;
  EXPECT_THAT(errorOf({.select = "no such device"}),
              AllOf(HasSubstr("\"no such device\""), HasSubstr("0: " + there)));
  EXPECT_THAT(errorOf({.select = "99"}), AllOf(HasSubstr("index 99"), HasSubstr("0: " + there)));
  EXPECT_THAT(errorOf({.select = "99999999999999999999999"}), HasSubstr("0: " + there));
}

TEST(DeviceSelection, RefusesANameThatFitsSeveralAndListsThem) {
  std::vector<Candidate> all;
  all.push_back(candidate("Twin", DeviceKind::discrete));
  all.push_back(candidate("twin", DeviceKind::discrete));
  rank(all);
  try {
    select(all, "TWIN");
    FAIL() << "chose one of two";
  } catch (const DeviceError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("more than one"), HasSubstr("0: Twin"), HasSubstr("1: twin")));
  }
}

TEST(DeviceErrors, NameWhatToInstallWithoutADriver) {
  const Environment drivers("VK_DRIVER_FILES", "/nonexistent.json");
  const Environment formerName("VK_ICD_FILENAMES", "/nonexistent.json");
  EXPECT_THAT(errorOf({}), AllOf(HasSubstr("mesa-vulkan-drivers"), HasSubstr("nvidia")));
  EXPECT_THROW(listDevices(), DeviceError);
}

TEST(DeviceErrors, NameWhatToInstallWithoutALoader) {
  // The library path is read when a program starts. So a child process starts with files that hide the real
  // loader.
  const std::filesystem::path directory =
      std::filesystem::path(::testing::TempDir()) / "clothstream_no_loader";
  std::filesystem::create_directories(directory);
  for (const char* name : {"libvulkan.so", "libvulkan.so.1"})
    std::ofstream(directory / name) << "not a library";
  const Environment path("LD_LIBRARY_PATH", directory.string());
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(
      {
        std::fputs(errorOf({}).c_str(), stderr);
        std::_Exit(3);
      },
      ::testing::ExitedWithCode(3), "libvulkan1.*mesa-vulkan-drivers");
  std::filesystem::remove_all(directory);
}

TEST(DeviceErrors, NameTheSettingIfValidationIsNotInstalled) {
  const Environment layers("VK_LAYER_PATH", "/nonexistent");
  EXPECT_THAT(errorOf({.validation = true}), HasSubstr("vulkan-validationlayers"));
}

TEST_F(DeviceTest, EnvironmentSwitchesValidationOn) {
  {
    const Environment on("CLOTHSTREAM_VALIDATION", "1");
    EXPECT_TRUE(Device().handles().validates());
  }
  for (const std::optional<std::string>& off : {std::optional<std::string>("0"), {""}, {}}) {
    const Environment environment("CLOTHSTREAM_VALIDATION", off);
    EXPECT_FALSE(Device().handles().validates());
    EXPECT_TRUE(Device({.validation = true}).handles().validates());
  }
}

TEST_F(DeviceTest, SoftwareDeviceRunsAsManyThreadsAsAsked) {
  if (!tests::device().isSoftware()) GTEST_SKIP() << "threads are chosen on software devices alone";
  const Environment overruled("LP_NUM_THREADS", "2");
  const std::size_t inlineOnly = threadsAddedBy({.softwareThreads = 0});
  const std::size_t one = threadsAddedBy({.softwareThreads = 1}) - inlineOnly;  // Mesa keeps several pools
  EXPECT_GE(one, 1u);
  EXPECT_EQ(threadsAddedBy({.softwareThreads = 3}), inlineOnly + 3 * one);
}

TEST_F(DeviceTest, SoftwareDeviceTakesThreadsFromTheEnvironmentOrOnePerProcessor) {
  if (!tests::device().isSoftware()) GTEST_SKIP() << "threads are chosen on software devices alone";
  const Environment given("LP_NUM_THREADS", "3");
  const std::size_t three = threadsAddedBy({.softwareThreads = 3});
  EXPECT_EQ(threadsAddedBy({}), three);
  const std::uint32_t processors = std::thread::hardware_concurrency();
  const std::size_t all = threadsAddedBy({.softwareThreads = processors > 1 ? processors : 0});
  unsetenv("LP_NUM_THREADS");
  EXPECT_EQ(threadsAddedBy({}), all);
}

TEST_F(DeviceTest, WaitingTimesOutWhileTheValueIsNotReached) {
  const Device device;
  EXPECT_EQ(device.completed(), 0u);
  EXPECT_TRUE(device.wait(0, std::chrono::nanoseconds(0)));
  EXPECT_FALSE(device.wait(1, std::chrono::milliseconds(1)));
}

TEST_F(DeviceTest, TimelineCountsSubmissions) {
  Device device;
  Recorder recorder(device);
  for (TimelineValue value = 1; value <= 3; ++value) {
    recorder.begin();
    EXPECT_EQ(device.submit(recorder), value);
    EXPECT_TRUE(device.wait(value));
    EXPECT_EQ(device.completed(), value);
  }
}

}  // namespace
}  // namespace clothstream::vulkan
