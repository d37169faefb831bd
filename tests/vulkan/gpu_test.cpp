// SPDX-License-Identifier: MIT
// Shared by tests on a Vulkan device: the device, functions that run work on it, and failure on validation
// messages.
#include "tests/vulkan/gpu_test.h"

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <stdexcept>
#include <string_view>

namespace clothstream::tests {
namespace {

std::unique_ptr<vulkan::Device> sharedDevice;
std::uint64_t expectedMessages = 0;

class ValidationListener : public ::testing::EmptyTestEventListener {
  void OnTestEnd(const ::testing::TestInfo&) override { failOnMessages(); }

 public:
  static void failOnMessages() {
    for (const std::string& text : takeValidationTexts()) ADD_FAILURE() << "Vulkan validation: " << text;
  }
};

class SharedDevice : public ::testing::Environment {
  void TearDown() override {
    sharedDevice.reset();
    ValidationListener::failOnMessages();
  }
};

bool validates() {
  const char* value = std::getenv("CLOTHSTREAM_VALIDATION");
  return value == nullptr || std::string_view(value) != "0";
}

[[maybe_unused]] const bool registered = [] {
  ::testing::AddGlobalTestEnvironment(new SharedDevice);
  ::testing::UnitTest::GetInstance()->listeners().Append(new ValidationListener);
  return true;
}();

}  // namespace

vulkan::Device& device() {
  if (!sharedDevice)
    sharedDevice = std::make_unique<vulkan::Device>(vulkan::DeviceOptions{.validation = validates()});
  return *sharedDevice;
}

void GpuTest::SetUp() {
  try {
    device();
  } catch (const vulkan::DeviceError& error) {
    GTEST_SKIP() << error.what();
  }
}

void submitAndWait(vulkan::Device& device, vulkan::Recorder& recorder) {
  device.wait(device.submit(recorder));
}

void run(const std::function<void(vulkan::Recorder&)>& record) {
  vulkan::Recorder recorder(device());
  recorder.begin();
  record(recorder);
  submitAndWait(device(), recorder);
}

std::vector<std::string> takeValidationTexts() {
  const std::uint64_t count = vulkan::Device::validationMessages();
  const std::vector<std::string> newest = vulkan::Device::validationTexts();
  const auto fresh =
      static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(count - expectedMessages, newest.size()));
  expectedMessages = count;
  return {newest.end() - fresh, newest.end()};
}

}  // namespace clothstream::tests
