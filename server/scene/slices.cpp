// SPDX-License-Identifier: MIT
#include "server/scene/slices.h"

#include <algorithm>
#include <utility>

namespace clothstream::scene {
namespace {

// Kernel invocations of a slice: first value (10 to 20 ns each on two processors), minimum, and maximum.
constexpr double kFirstSlice = 1 << 19, kMinSlice = 1 << 12, kMaxSlice = 1e15;
// A GPU is faster by at least this factor.
constexpr double kGpuFactor = 64;
// Most work of a slice, in slices: work that depends on the state, such as the pairs of a heap, can be that
// much more than in the ticks before. It is limited by the first slice, because slices of calm ticks grow.
// At first it is one slice, since such work is not known yet, and it grows while slices are short.
constexpr double kMostWork = 16;

}  // namespace

Slices::Slices(vulkan::Device& device, vulkan::Recorder& recorder)
    : device_(device), recorder_(recorder), first_(firstSlice(device)), invocations_(first_) {
  sliceRecordings();
}

double Slices::firstSlice(const vulkan::Device& device) {
  return device.isSoftware() ? kFirstSlice : kGpuFactor * kFirstSlice;
}

void Slices::scale(double factor) {
  const double bounded = std::clamp(factor, 0.25, 1.25);
  invocations_ = std::clamp(invocations_ * bounded, kMinSlice, kMaxSlice);
  mostWork_ = std::clamp(mostWork_ * bounded, 1.0, kMostWork);
  sliceRecordings();
}

void Slices::sliceRecordings() {
  recorder_.sliceAfter(static_cast<std::uint64_t>(invocations_),
                       static_cast<std::uint64_t>(mostWork_ * std::min(invocations_, first_)));
}

void Slices::begin() {
  next_ = 0;
  longest_ = {};
}

void Slices::join(vulkan::Batch& batch) {
  batch.add(recorder_);
  ++next_;
}

void Slices::submit() {
  submittedAt_ = Clock::now();
  inFlight_ = true;
  submitted_ = device_.submitSlice(recorder_, next_++);
}

void Slices::wait(Clock::time_point deviceFree) {
  if (!std::exchange(inFlight_, false)) return;
  device_.wait(submitted_);
  longest_ = std::max(longest_, Clock::now() - std::max(submittedAt_, deviceFree));
}

void Slices::adapt() {
  const double factor = schedule::seconds(kTime) / schedule::seconds(longest_);
  if (factor < 1 || recorder_.sliceCount() > 1) scale(factor);
}

}  // namespace clothstream::scene
