// SPDX-License-Identifier: MIT
// Shared by tests on a Vulkan device: the device, functions that run work on it, and failure on validation
// messages.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::tests {

// In programs that link `clothstream_gpu_test`, a message of the validation layer fails the running test. A
// message while the shared device is closed fails the program, because an object on it was not destroyed. The
// shared device always validates, except with CLOTHSTREAM_VALIDATION=0, for machines without the layer.
// Devices that tests open do so under ctest, which sets CLOTHSTREAM_VALIDATION=1.

// The device of this test program. The first call opens it; it closes after the last test. Throws
// vulkan::DeviceError if no device is usable.
vulkan::Device& device();

// Skips the test, with the reason, if there is no device.
class GpuTest : public ::testing::Test {
 protected:
  void SetUp() override;
};

// Submits the recording and waits for it. Throws std::runtime_error if it takes longer than a minute.
void submitAndWait(vulkan::Device& device, vulkan::Recorder& recorder);

// Records with `record` on the shared device, submits and waits.
void run(const std::function<void(vulkan::Recorder&)>& record);

// Returns the messages of the validation layer since the test began or the last call. The caller expects
// them, so that they do not fail the test.
std::vector<std::string> takeValidationTexts();

}  // namespace clothstream::tests
