// SPDX-License-Identifier: MIT
// Buffers, kernels and recordings: correct content and correct order.
#include <bit>
#include <numeric>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>

#include "kernels/add_scaled.h"
#include "kernels/count_up.h"
#include "kernels/gather_texels.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"
#include "tests/vulkan/gpu_test.h"

namespace clothstream::vulkan {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

using ComputeTest = tests::GpuTest;

Buffer uploadOf(const std::vector<std::uint32_t>& values) {
  Buffer buffer(tests::device(), BufferPurpose::upload, values.size() * sizeof(std::uint32_t));
  std::copy(values.begin(), values.end(), buffer.mapped<std::uint32_t>().begin());
  return buffer;
}

std::vector<std::uint32_t> countedFrom(std::uint32_t first, std::size_t count) {
  std::vector<std::uint32_t> values(count);
  std::iota(values.begin(), values.end(), first);
  return values;
}

template <typename T>
std::vector<T> contents(const Buffer& buffer) {
  const std::span<T> mapped = buffer.mapped<T>();
  return {mapped.begin(), mapped.end()};
}

Kernel countUp(std::uint32_t workgroupSize = 64) {
  return {tests::device(), kernels::count_up, workgroupSize};
}

TEST_F(ComputeTest, BufferContentsSurviveTheRoundTrip) {
  constexpr std::size_t kCount = 1000;
  constexpr std::size_t kBytes = kCount * sizeof(std::uint32_t);
  for (const BufferPurpose purpose : {BufferPurpose::state, BufferPurpose::texels, BufferPurpose::indirect}) {
    const Buffer upload = uploadOf(countedFrom(7, kCount));
    const Buffer state(tests::device(), purpose, kBytes);
    const Buffer readback(tests::device(), BufferPurpose::readback, kBytes);
    EXPECT_THAT(state.mapped(), IsEmpty());
    tests::run([&](Recorder& recorder) {
      recorder.copy(upload, state, kBytes);
      recorder.barrier();
      recorder.copy(state, readback, kBytes);
    });
    EXPECT_EQ(contents<std::uint32_t>(readback), countedFrom(7, kCount));
  }
}

TEST_F(ComputeTest, CopiesAndFillsTouchOnlyTheirRange) {
  const Buffer upload = uploadOf({1, 2, 3, 4});
  const Buffer readback(tests::device(), BufferPurpose::readback, 6 * sizeof(std::uint32_t));
  tests::run([&](Recorder& recorder) {
    recorder.fill(readback, 9, readback.bytes());
    recorder.barrier();
    recorder.copy(upload, readback, 8, 4, 8);
    recorder.fill(readback, 5, 4, 20);
    recorder.copy(upload, readback, 0);
  });
  EXPECT_EQ(contents<std::uint32_t>(readback), (std::vector<std::uint32_t>{9, 9, 2, 3, 9, 5}));
}

TEST_F(ComputeTest, MovedBufferKeepsItsContentsAndLeavesAnEmptyOne) {
  Buffer from = uploadOf({1, 2, 3});
  const Buffer to = std::move(from);
  EXPECT_EQ(contents<std::uint32_t>(to), (std::vector<std::uint32_t>{1, 2, 3}));
  EXPECT_EQ(Buffer().bytes(), 0u);
  EXPECT_THAT(Buffer().mapped(), IsEmpty());
}

TEST_F(ComputeTest, KernelGetsSpecialisationPushConstantsAndWorkgroupSize) {
  struct Push {
    std::uint32_t count;
    float factor;
  };
  constexpr std::uint32_t kCount = 100;  // not a multiple of the workgroup size
  for (const std::uint32_t workgroupSize : {1u, 8u, 64u, 128u}) {
    const Kernel kernel(tests::device(), kernels::add_scaled, workgroupSize,
                        {3, std::bit_cast<std::uint32_t>(0.5f)});
    const Buffer values(tests::device(), BufferPurpose::readback, (kCount + 28) * sizeof(float));
    std::fill(values.mapped<float>().begin(), values.mapped<float>().end(), 1.0f);
    const Bindings bindings(tests::device(), kernel, {&values});
    tests::run([&](Recorder& recorder) { recorder.dispatch(bindings, Push{kCount, 2.0f}, kCount); });
    for (std::uint32_t i = 0; i < kCount + 28; ++i) {
      const float expected = i < kCount ? 1.0f + 2.0f * (3.0f * static_cast<float>(i) + 0.5f) : 1.0f;
      EXPECT_EQ(values.mapped<float>()[i], expected) << i;  // small integers and halves are exact
    }
  }
}

TEST_F(ComputeTest, KernelKnowsItsInterface) {
  const SpirvInterface adds = interfaceOf(kernels::add_scaled.spirv),
                       gathers = interfaceOf(kernels::gather_texels.spirv);
  EXPECT_EQ(adds.pushConstantBytes, 8u);
  ASSERT_EQ(adds.bindings.size(), 1u);
  EXPECT_EQ(adds.bindings[0].kind, BindingKind::storage);
  EXPECT_EQ(adds.constants.size(), 2u);
  EXPECT_EQ(gathers.pushConstantBytes, 4u);
  ASSERT_EQ(gathers.bindings.size(), 2u);
  EXPECT_EQ(gathers.bindings[0].kind, BindingKind::texels);
  EXPECT_TRUE(gathers.bindings[0].reads && !gathers.bindings[0].writes);
  EXPECT_EQ(gathers.bindings[1].kind, BindingKind::storage);
  EXPECT_TRUE(gathers.bindings[1].writes);
}

TEST_F(ComputeTest, BindingsAreOneForEachBuffer) {
  const Buffer buffer = uploadOf({1});
  EXPECT_THROW(Bindings(tests::device(), countUp(), {&buffer}), std::logic_error);
  EXPECT_THROW(Bindings(tests::device(), countUp(), {&buffer, &buffer, &buffer}), std::logic_error);
}

TEST_F(ComputeTest, PushConstantsHaveTheKernelsSize) {
  const Buffer buffer = uploadOf({1});
  const Bindings bindings(tests::device(), countUp(), {&buffer, &buffer});
  Recorder recorder(tests::device());
  recorder.begin();
  EXPECT_THROW(recorder.dispatch(bindings, std::uint64_t{1}, 1), std::logic_error);
}

TEST_F(ComputeTest, KernelReadsTexelsThatCopiesWrote) {
  constexpr std::uint32_t kCount = 300;
  const Buffer upload(tests::device(), BufferPurpose::upload, kCount * 16);
  for (std::uint32_t i = 0; i < kCount * 4; ++i) upload.mapped<float>()[i] = static_cast<float>(i);
  const Buffer texels(tests::device(), BufferPurpose::texels, kCount * 16);
  const Buffer sums(tests::device(), BufferPurpose::readback, kCount * sizeof(float));
  const Bindings bindings(tests::device(), {tests::device(), kernels::gather_texels, 64}, {&texels, &sums});
  tests::run([&](Recorder& recorder) {
    recorder.copy(upload, texels, upload.bytes());
    recorder.barrier();
    recorder.dispatch(bindings, kCount, kCount);
  });
  for (std::uint32_t i = 0; i < kCount; ++i) {
    const std::uint32_t texel = (i + 1) % kCount;
    EXPECT_EQ(sums.mapped<float>()[i], static_cast<float>(16 * texel + 6))
        << i;  // 4t + (4t+1) + (4t+2) + (4t+3)
  }
}

// After k steps of to[i] = from[(i + 1) mod n] + 1 from from[i] = i, element i is (i + k) mod n + k.
std::vector<std::uint32_t> countedUp(std::uint32_t count, std::uint32_t steps) {
  std::vector<std::uint32_t> values(count);
  for (std::uint32_t i = 0; i < count; ++i) values[i] = (i + steps) % count + steps;
  return values;
}

TEST_F(ComputeTest, BarriersOrderDependentDispatches) {
  constexpr std::uint32_t kCount = 4096;
  constexpr std::uint32_t kSteps = 100;
  const Buffer upload = uploadOf(countedFrom(0, kCount));
  const Buffer a(tests::device(), BufferPurpose::state, upload.bytes());
  const Buffer b(tests::device(), BufferPurpose::state, upload.bytes());
  const Buffer readback(tests::device(), BufferPurpose::readback, upload.bytes());
  const Kernel kernel = countUp();
  const Bindings there(tests::device(), kernel, {&a, &b});
  const Bindings back(tests::device(), kernel, {&b, &a});
  tests::run([&](Recorder& recorder) {
    recorder.copy(upload, a, upload.bytes());
    for (std::uint32_t step = 0; step < kSteps; ++step) {
      recorder.barrier();
      recorder.dispatch(step % 2 == 0 ? there : back, kCount, kCount);
    }
    recorder.barrier();
    recorder.copy(a, readback, readback.bytes());
  });
  EXPECT_EQ(contents<std::uint32_t>(readback), countedUp(kCount, kSteps));
}

TEST_F(ComputeTest, RecordingsSeeTheWorkOfEarlierOnesWithoutWaiting) {
  constexpr std::uint32_t kCount = 4096;
  const Buffer upload = uploadOf(countedFrom(0, kCount));
  const Buffer a(tests::device(), BufferPurpose::state, upload.bytes());
  const Buffer readback(tests::device(), BufferPurpose::readback, upload.bytes());
  const Kernel kernel = countUp();
  const Bindings first(tests::device(), kernel, {&upload, &a});
  const Bindings second(tests::device(), kernel, {&a, &readback});
  Recorder early(tests::device());
  Recorder late(tests::device());
  early.begin();
  early.dispatch(first, kCount, kCount);
  late.begin();
  late.dispatch(second, kCount, kCount);
  tests::device().submit(early);
  tests::submitAndWait(tests::device(), late);
  EXPECT_EQ(contents<std::uint32_t>(readback), countedUp(kCount, 2));
}

// Each dispatch depends on the one before, also across slices and with other recordings in between.
TEST_F(ComputeTest, SlicesGiveTheResultOfTheWholeRecording) {
  constexpr std::uint32_t kCount = 256, kSteps = 10;
  const Buffer upload = uploadOf(countedFrom(0, kCount));
  const Buffer a(tests::device(), BufferPurpose::state, upload.bytes());
  const Buffer b(tests::device(), BufferPurpose::state, upload.bytes());
  const Buffer other(tests::device(), BufferPurpose::readback, upload.bytes());
  const Kernel kernel = countUp();
  const Bindings there(tests::device(), kernel, {&a, &b});
  const Bindings back(tests::device(), kernel, {&b, &a});
  Recorder recorder(tests::device()), between(tests::device());
  for (const auto& [limit, slices] : {std::pair{1u, kSteps}, {3 * kCount, 4u}, {kSteps * kCount, 1u}}) {
    const Buffer readback(tests::device(), BufferPurpose::readback, upload.bytes());
    recorder.sliceAfter(limit);
    recorder.begin();
    recorder.copy(upload, a, upload.bytes());
    for (std::uint32_t step = 0; step < kSteps; ++step) {
      recorder.barrier();
      recorder.dispatch(step % 2 == 0 ? there : back, kCount, kCount);
    }
    recorder.barrier();
    recorder.copy(a, readback, readback.bytes());
    ASSERT_EQ(recorder.sliceCount(), slices);
    for (std::uint32_t slice = 0; slice < slices; ++slice) {
      const TimelineValue submitted = tests::device().submitSlice(recorder, slice);
      between.begin();
      between.fill(other, slice, other.bytes());
      tests::submitAndWait(tests::device(), between);
      EXPECT_GE(tests::device().completed(), submitted);
    }
    EXPECT_EQ(contents<std::uint32_t>(readback), countedUp(kCount, kSteps));
  }
}

TEST_F(ComputeTest, DispatchLargerThanASliceIsDivided) {
  constexpr std::uint32_t kCount = 1 << 16, kWork = 8, kSlice = 1 << 17;
  const Buffer upload = uploadOf(countedFrom(0, kCount));
  const Buffer readback(tests::device(), BufferPurpose::readback, upload.bytes());
  const Kernel kernel = countUp();
  const Bindings bindings(tests::device(), kernel, {&upload, &readback});
  Recorder recorder(tests::device());
  recorder.sliceAfter(kSlice);
  recorder.begin();
  EXPECT_TRUE(recorder.divides(bindings, kCount, kWork));
  EXPECT_FALSE(recorder.divides(bindings, kCount, 1));
  recorder.dispatch(bindings, kCount, kCount, kWork);
  EXPECT_LE(recorder.largestDispatch(),
            std::max(kSlice, tests::device().limits().parallelWorkgroups * kernel.workgroupSize() * kWork));
  EXPECT_GE(recorder.sliceCount(), std::uint64_t{kCount} * kWork / recorder.largestDispatch());
  EXPECT_GT(recorder.sliceCount(), 1u);
  tests::submitAndWait(tests::device(), recorder);
  EXPECT_EQ(contents<std::uint32_t>(readback), countedUp(kCount, 1));
}

// Work that depends on the data: few slices by what is expected, and more by what there may be at most.
TEST_F(ComputeTest, SlicesAndDispatchesAreBoundedByTheirMostWork) {
  constexpr std::uint64_t kLimit = 1 << 20, kMost = 1 << 18;
  const Kernel kernel = countUp();
  Buffer values = uploadOf(std::vector<std::uint32_t>(1 << 14, 0)), counts = uploadOf({0});
  const Bindings bindings(tests::device(), kernel, {&values, &counts});
  Recorder recorder(tests::device());
  const auto record = [&](std::uint64_t most) {
    recorder.begin();
    for (int i = 0; i < 4; ++i) {
      recorder.barrier();
      recorder.dispatch(bindings, std::uint32_t{0}, 1 << 14, 1, most);
    }
    recorder.finish();
    return recorder.sliceCount();
  };
  recorder.sliceAfter(kLimit);
  EXPECT_EQ(record(16), 1u);
  recorder.sliceAfter(kLimit, kMost);
  EXPECT_EQ(record(0), 1u);
  EXPECT_EQ(record(16), 4u) << "one dispatch fills a slice";
  EXPECT_EQ(recorder.mostOfDispatch(), kMost);
  EXPECT_EQ(record(64), 16u) << "each dispatch is divided into four";
  EXPECT_EQ(recorder.mostOfDispatch(), kMost);
}

TEST_F(ComputeTest, WorkBetweenSlicesBelongsToNoStage) {
  constexpr std::uint32_t kCount = 256, kSteps = 6;
  constexpr std::size_t kHeavyBytes = 64u << 20;
  const Buffer a = uploadOf(countedFrom(0, kCount));
  const Buffer b(tests::device(), BufferPurpose::readback, a.bytes());
  const Buffer other(tests::device(), BufferPurpose::state, kHeavyBytes);
  const Kernel kernel = countUp();
  const Bindings bindings(tests::device(), kernel, {&a, &b});
  Recorder recorder(tests::device()), between(tests::device());
  recorder.sliceAfter(1);
  recorder.begin();
  recorder.beginStage("first");
  for (std::uint32_t step = 0; step < kSteps; ++step) {
    if (step == kSteps / 2) recorder.beginStage("second");
    recorder.dispatch(bindings, kCount, kCount);
    recorder.barrier();
  }
  ASSERT_EQ(recorder.sliceCount(), kSteps);
  double elsewhere = 0;
  for (std::uint32_t slice = 0; slice < kSteps; ++slice) {
    tests::device().submitSlice(recorder, slice);
    between.begin();
    between.beginStage("elsewhere");
    for (std::uint32_t fill = 0; fill < 4; ++fill) {
      between.fill(other, fill, kHeavyBytes);
      between.barrier();
    }
    tests::submitAndWait(tests::device(), between);
    if (between.stageTimes().empty()) GTEST_SKIP() << "the device has no timestamps";
    elsewhere += between.stageTimes().front().seconds;
  }
  double seconds = 0;
  std::vector<std::string> names;
  for (const StageTime& time : recorder.stageTimes()) {
    names.emplace_back(time.stage);
    seconds += time.seconds;
  }
  EXPECT_THAT(names, ::testing::ElementsAre("first", "second"));
  EXPECT_GT(seconds, 0);
  EXPECT_LT(seconds, elsewhere / 2);
}

TEST_F(ComputeTest, RecordingRunsAgainWhenItIsSubmittedAgain) {
  constexpr std::uint32_t kCount = 64;
  const Buffer a = uploadOf(countedFrom(0, kCount));
  const Buffer b(tests::device(), BufferPurpose::readback, a.bytes());
  const Kernel kernel = countUp();
  const Bindings bindings(tests::device(), kernel, {&a, &b});
  Recorder recorder(tests::device());
  recorder.begin();
  recorder.beginStage("count");
  recorder.dispatch(bindings, kCount, kCount);
  tests::submitAndWait(tests::device(), recorder);
  std::fill(a.mapped<std::uint32_t>().begin(), a.mapped<std::uint32_t>().end(), 41u);
  tests::submitAndWait(tests::device(), recorder);
  EXPECT_THAT(contents<std::uint32_t>(b), Each(42u));
}

TEST_F(ComputeTest, EqualKernelsShareAPipeline) {
  std::optional<Kernel> first = countUp(), second = countUp();
  const Kernel other = countUp(32);
  EXPECT_EQ(&first->handles(), &second->handles());
  EXPECT_NE(&first->handles(), &other.handles());
  const Buffer a = uploadOf(countedFrom(0, 64));
  const Buffer b(tests::device(), BufferPurpose::readback, a.bytes());
  first.reset();
  const Bindings bindings(tests::device(), *second, {&a, &b});
  tests::run([&](Recorder& recorder) { recorder.dispatch(bindings, 64u, 64); });
  EXPECT_EQ(contents<std::uint32_t>(b), countedUp(64, 1));
}

TEST_F(ComputeTest, ARehearsalRunsNoKernelAndNotesEachOnce) {
  constexpr std::uint32_t kCount = 64;
  const Buffer a = uploadOf(countedFrom(0, kCount));
  const Buffer b(tests::device(), BufferPurpose::readback, a.bytes());
  const Kernel kernel = countUp(), other = countUp(32);
  const Bindings bindings(tests::device(), kernel, {&a, &b}), same(tests::device(), kernel, {&a, &b}),
      others(tests::device(), other, {&a, &b});
  Recorder recorder(tests::device());
  recorder.beginRehearsal();
  recorder.fill(b, 7, b.bytes());
  for (const Bindings* one : {&bindings, &same, &others}) recorder.dispatch(*one, kCount, kCount);
  tests::submitAndWait(tests::device(), recorder);
  using ::testing::AllOf, ::testing::Field;
  EXPECT_THAT(recorder.rehearsed(), ::testing::ElementsAre(AllOf(Field(&RehearsedKernel::bindings, &bindings),
                                                                 Field(&RehearsedKernel::invocations, kCount),
                                                                 Field(&RehearsedKernel::dispatches, 2u)),
                                                           AllOf(Field(&RehearsedKernel::bindings, &others),
                                                                 Field(&RehearsedKernel::dispatches, 1u))));
  for (const RehearsedKernel& one : recorder.rehearsed()) {
    recorder.begin();
    recorder.touch(*one.bindings);
    tests::submitAndWait(tests::device(), recorder);
  }
  EXPECT_THAT(contents<std::uint32_t>(b), Each(7u));
  recorder.begin();
  recorder.dispatch(bindings, kCount, kCount);
  tests::submitAndWait(tests::device(), recorder);
  EXPECT_EQ(contents<std::uint32_t>(b), countedUp(kCount, 1));
}

TEST_F(ComputeTest, DeviceDecidesTheSizeOfAnIndirectDispatch) {
  constexpr std::uint32_t kCount = 256;
  const Buffer groups(tests::device(), BufferPurpose::indirect, 4 * sizeof(std::uint32_t));
  const Buffer a = uploadOf(countedFrom(0, kCount));
  const Buffer b(tests::device(), BufferPurpose::readback, a.bytes());
  const Kernel kernel = countUp();
  const Bindings bindings(tests::device(), kernel, {&a, &b});
  tests::run([&](Recorder& recorder) {
    recorder.fill(groups, 1, groups.bytes());
    recorder.barrier();
    recorder.fill(groups, 2, 4, 4);
    recorder.fill(b, 0, b.bytes());
    recorder.barrier();
    recorder.dispatchIndirect(bindings, kCount, groups, 4, 128);  // 2 x 1 x 1 workgroups of 64
  });
  std::vector<std::uint32_t> expected = countedUp(kCount, 1);
  std::fill(expected.begin() + 128, expected.end(), 0u);
  EXPECT_EQ(contents<std::uint32_t>(b), expected);
}

TEST_F(ComputeTest, StageTimesAddUpByNameAndFitIntoTheWaiting) {
  constexpr std::size_t kHeavyBytes = 64u << 20;
  constexpr std::size_t kLightBytes = 4u << 10;
  const Buffer buffer(tests::device(), BufferPurpose::state, kHeavyBytes);
  Recorder recorder(tests::device());
  recorder.begin();
  for (int i = 0; i < 2; ++i) {
    recorder.beginStage("heavy");
    recorder.fill(buffer, 1, kHeavyBytes);
    recorder.barrier();
    recorder.beginStage("light");
    recorder.fill(buffer, 2, kLightBytes);
    recorder.barrier();
  }
  const auto start = std::chrono::steady_clock::now();
  tests::submitAndWait(tests::device(), recorder);
  const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - start;
  const std::span<const StageTime> times = recorder.stageTimes();
  if (times.empty()) GTEST_SKIP() << "the device has no timestamps";
  ASSERT_EQ(times.size(), 2u);
  EXPECT_EQ(times[0].stage, "heavy");
  EXPECT_EQ(times[1].stage, "light");
  EXPECT_GT(times[0].seconds, 0);
  EXPECT_GE(times[1].seconds, 0);
  // Both clocks count real time. They drift apart by less than a thousandth.
  EXPECT_LE(times[0].seconds + times[1].seconds, waited.count() * 1.001);
}

TEST_F(ComputeTest, RecordingWithoutStagesHasNoTimes) {
  Recorder recorder(tests::device());
  recorder.begin();
  tests::submitAndWait(tests::device(), recorder);
  EXPECT_THAT(recorder.stageTimes(), IsEmpty());
}

template <typename Act>
std::string runtimeErrorOf(Act act) {
  try {
    act();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

TEST_F(ComputeTest, TooLargeABufferIsRefusedWithItsSizeAndTheLimit) {
  const Limits& limits = tests::device().limits();
  const std::size_t tooLarge = limits.maxStorageRange + 16;
  const std::string error =
      runtimeErrorOf([&] { const Buffer buffer(tests::device(), BufferPurpose::state, tooLarge); });
  EXPECT_THAT(error, HasSubstr(std::to_string(tooLarge) + " bytes"));
  EXPECT_THAT(error, HasSubstr(std::to_string(limits.maxStorageRange)));
  EXPECT_THAT(runtimeErrorOf([&] {
                const Buffer buffer(tests::device(), BufferPurpose::readback, std::size_t{1} << 60);
              }),
              HasSubstr(std::to_string(std::size_t{1} << 60)));
}

TEST_F(ComputeTest, ABufferBeyondTheDevicesAllocationsIsRefused) {
  const Device few({.maxAllocations = 3, .largestBlock = 1});
  EXPECT_GE(tests::device().limits().maxAllocations, 4096u);
  std::vector<Buffer> buffers;
  for (int i = 0; i < 3; ++i) buffers.emplace_back(few, BufferPurpose::state, 16);
  EXPECT_THAT(runtimeErrorOf([&] { const Buffer fourth(few, BufferPurpose::state, 16); }),
              HasSubstr("no room in the 3 allocations of memory"));
  EXPECT_EQ(few.allocations(), 3u);
  buffers.pop_back();
  EXPECT_NO_THROW(Buffer(few, BufferPurpose::state, 16));
}

TEST_F(ComputeTest, BytesOfAThreadAreThoseOfItsOwnBuffers) {
  const std::uint64_t before = Buffer::bytesOfThread();
  std::optional<Buffer> own(std::in_place, tests::device(), BufferPurpose::state, 1 << 20);
  std::optional<Buffer> others;
  std::thread([&] { others.emplace(tests::device(), BufferPurpose::state, 4 << 20); }).join();
  const std::uint64_t added = Buffer::bytesOfThread() - before;
  EXPECT_GE(added, 1u << 20);
  EXPECT_LT(added, 4u << 20);
  own.reset();
  EXPECT_EQ(Buffer::bytesOfThread(), before);
}

TEST_F(ComputeTest, TooLargeADispatchIsRefusedNamingTheKernel) {
  const std::uint64_t limit = tests::device().limits().maxDispatchX;
  const Buffer a = uploadOf({0});
  const Kernel kernel = countUp(1);
  const Bindings bindings(tests::device(), kernel, {&a, &a});
  Recorder recorder(tests::device());
  recorder.begin();
  EXPECT_THAT(runtimeErrorOf([&] { recorder.dispatch(bindings, 1u, limit + 1); }),
              AllOf(HasSubstr("count_up"), HasSubstr(std::to_string(limit + 1))));
}

TEST_F(ComputeTest, TooLargeAWorkgroupIsRefusedNamingTheKernel) {
  const std::uint32_t tooLarge = tests::device().limits().maxWorkgroupInvocations + 1;
  EXPECT_THAT(runtimeErrorOf([&] { countUp(tooLarge); }),
              AllOf(HasSubstr("count_up"), HasSubstr(std::to_string(tooLarge))));
}

}  // namespace
}  // namespace clothstream::vulkan
