// SPDX-License-Identifier: MIT
// Runs the ticks of a scene on the device, in slices or as a part of a batch.
#pragma once

#include <chrono>
#include <cstdint>

#include "server/schedule/clock.h"
#include "server/vulkan/batch.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::scene {

using schedule::Clock;

// A tick that takes longer than kTime is submitted in slices of about this time, whose size follows from the
// time of earlier slices. A tick of one slice may be submitted in a batch with those of other scenes instead.
// Belongs to the thread of the recorder.
class Slices {
 public:
  static constexpr std::chrono::milliseconds kTime{10};

  // Both must outlive this object. The slices of the first recordings have a fixed size.
  Slices(vulkan::Device& device, vulkan::Recorder& recorder);

  // Makes the slices of the following recordings larger or smaller by about this factor.
  void scale(double factor);

  // Work of the first slice on a device, in kernel invocations.
  static double firstSlice(const vulkan::Device& device);

  // A tick is recorded.
  void begin();
  // Returns whether no slice of the tick was submitted.
  bool isUnsubmitted() const { return next_ == 0; }
  // Returns whether the tick may be submitted in a batch.
  bool fitsIntoBatch() const { return isUnsubmitted() && recorder_.sliceCount() == 1; }
  // Adds the tick to a batch, which is submitted and waited for by the caller.
  void join(vulkan::Batch& batch);
  // Returns whether slices are not submitted yet.
  bool hasMore() const { return next_ < recorder_.sliceCount(); }
  // Submits the next slice. Throws vulkan::DeviceLost.
  void submit();
  // Waits for the submitted slice, if there is one. The device was busy with other work until `deviceFree`.
  // Throws vulkan::DeviceLost.
  void wait(Clock::time_point deviceFree = {});
  // The tick is complete: chooses the size of the slices of the next one.
  void adapt();

 private:
  void sliceRecordings();

  vulkan::Device& device_;
  vulkan::Recorder& recorder_;
  const double first_;   // kernel invocations of a slice, at first
  double invocations_;   // the same, now
  double mostWork_ = 1;  // most work of a slice, in slices
  std::uint32_t next_ = 0;
  bool inFlight_ = false;
  vulkan::TimelineValue submitted_ = 0;
  Clock::time_point submittedAt_{};
  Clock::duration longest_{};  // slice of the present tick
};

}  // namespace clothstream::scene
