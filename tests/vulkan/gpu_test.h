// SPDX-License-Identifier: MIT
// What tests on a Vulkan device share: the device, a way to run work on it, and validation that fails tests.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::tests {

// Linking `clothstream_gpu_test` makes a test fail when the validation layer says anything while it runs, and
// the program when closing the shared device makes it speak (something still lives on it). The shared device
// always validates; devices that tests open themselves do so under ctest, which sets
// CLOTHSTREAM_VALIDATION=1.

// The device of this test program. The first call opens it; it closes after the last test. Throws
// vulkan::DeviceError if no device is usable.
vulkan::Device& device();

// Skips its tests, with the reason, if there is no device.
class GpuTest : public ::testing::Test {
 protected:
  void SetUp() override;
};

// Submits the recording and waits for it. Throws std::runtime_error if it takes longer than a minute.
void submitAndWait(vulkan::Device& device, vulkan::Recorder& recorder);

// Records by `record` on the shared device, submits and waits.
void run(const std::function<void(vulkan::Recorder&)>& record);

// Returns the messages of the validation layer since the test began or the last call. The caller expects
// them, so that they do not fail the test.
std::vector<std::string> takeValidationTexts();

}  // namespace clothstream::tests
