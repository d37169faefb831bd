// SPDX-License-Identifier: MIT
// Validation is active: deliberate mistakes are reported, and correct work is not.
#include <array>
#include <memory>
#include <utility>

#include <gmock/gmock.h>

#include "kernels/count_up.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/handles.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::vulkan {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::uint32_t kCount = 256;

// Two dispatches on a device that always validates. The second reads the buffer that the first writes.
class ValidationTest : public tests::GpuTest {
 protected:
  void SetUp() override {
    tests::GpuTest::SetUp();
    if (IsSkipped()) return;
    device_ = std::make_unique<Device>(DeviceOptions{.validation = true});
    for (Buffer& buffer : buffers_)
      buffer = Buffer(*device_, BufferPurpose::state, kCount * sizeof(std::uint32_t));
    const Kernel kernel(*device_, kernels::count_up, 64);
    first_ = std::make_unique<Bindings>(*device_, kernel,
                                        std::initializer_list<const Buffer*>{&buffers_[0], &buffers_[1]});
    second_ = std::make_unique<Bindings>(*device_, kernel,
                                         std::initializer_list<const Buffer*>{&buffers_[1], &buffers_[2]});
  }

  // A command buffer with one dispatch and no barrier, which Recorder would not make.
  vk::raii::CommandBuffer bareDispatch(const vk::raii::CommandPool& pool, const Bindings& bindings) const {
    vk::raii::CommandBuffer commands = std::move(
        vk::raii::CommandBuffers(device_->handles().device,
                                 vk::CommandBufferAllocateInfo{.commandPool = *pool, .commandBufferCount = 1})
            .front());
    commands.begin(vk::CommandBufferBeginInfo{});
    commands.bindPipeline(vk::PipelineBindPoint::eCompute, *bindings.kernel().handles().pipeline);
    commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *bindings.kernel().handles().layout, 0,
                                *bindings.handles().set, nullptr);
    commands.pushConstants<std::uint32_t>(*bindings.kernel().handles().layout,
                                          vk::ShaderStageFlagBits::eCompute, 0, kCount);
    commands.dispatch(kCount / bindings.kernel().workgroupSize(), 1, 1);
    commands.end();
    return commands;
  }

  std::unique_ptr<Device> device_;
  std::array<Buffer, 3> buffers_;
  std::unique_ptr<Bindings> first_, second_;
};

TEST_F(ValidationTest, IsSilentAboutCorrectBarriers) {
  Recorder recorder(*device_);
  recorder.begin();
  recorder.fill(buffers_[0], 1, buffers_[0].bytes());
  recorder.barrier();
  recorder.dispatch(*first_, kCount, kCount);
  recorder.barrier();
  recorder.dispatch(*second_, kCount, kCount);
  tests::submitAndWait(*device_, recorder);
  EXPECT_THAT(tests::takeValidationTexts(), IsEmpty());
}

TEST_F(ValidationTest, ReportsAMissingBarrierWithinARecording) {
  const std::uint64_t before = Device::validationMessages();
  Recorder recorder(*device_);
  recorder.begin();
  recorder.dispatch(*first_, kCount, kCount);
  recorder.dispatch(*second_, kCount, kCount);
  tests::submitAndWait(*device_, recorder);
  EXPECT_GT(Device::validationMessages(), before);
  EXPECT_THAT(tests::takeValidationTexts(), Contains(HasSubstr("SYNC-HAZARD-READ-AFTER-WRITE")));
}

TEST_F(ValidationTest, ReportsAMissingBarrierBetweenSubmissions) {
  const vk::raii::CommandPool pool(
      device_->handles().device,
      vk::CommandPoolCreateInfo{.queueFamilyIndex = device_->handles().queueFamily});
  const vk::raii::CommandBuffer first = bareDispatch(pool, *first_);
  const vk::raii::CommandBuffer second = bareDispatch(pool, *second_);
  const vk::raii::Queue queue = device_->handles().device.getQueue(device_->handles().queueFamily, 0);
  queue.submit(vk::SubmitInfo{.commandBufferCount = 1, .pCommandBuffers = &*first});
  EXPECT_THAT(tests::takeValidationTexts(), IsEmpty());
  queue.submit(vk::SubmitInfo{.commandBufferCount = 1, .pCommandBuffers = &*second});
  queue.waitIdle();
  EXPECT_THAT(tests::takeValidationTexts(), Contains(HasSubstr("SYNC-HAZARD-READ-AFTER-WRITE")));
}

}  // namespace
}  // namespace clothstream::vulkan
