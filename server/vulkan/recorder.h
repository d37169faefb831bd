// SPDX-License-Identifier: MIT
// Records work for the device: bind, push, dispatch, copy, barrier, timestamp.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recording.h"
#include "server/vulkan/stage_time.h"

namespace clothstream::vulkan {

// Kernel that a rehearsal noted.
struct RehearsedKernel {
  const Bindings* bindings = nullptr;  // of its first dispatch
  std::uint64_t invocations = 0;       // of its largest dispatch
  std::uint64_t dispatches = 0;
};

// Reusable command buffers with their timestamps. Belongs to one thread at a time. Allocates no memory after
// its longest recording. Commands are data until the recording is submitted, alone or in a Batch; what they
// refer to has to exist until it is complete. On a device that only compiles (Device::executes), every
// recording is a rehearsal: it notes kernels and has no commands.
class Recorder {
 public:
  explicit Recorder(const Device& device);
  ~Recorder();
  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;

  // Divides recordings, from the next begin() on, into slices that can be submitted one by one, so that other
  // work can run between them. A slice ends before the first dispatch that would exceed `invocations` in all,
  // and has one dispatch at least. It also ends before the first one with which the most work of its
  // dispatches would exceed `most`. A dispatch with a stated work (below) that exceeds `invocations` or
  // `most` by itself is divided. By default a recording has one slice.
  void sliceAfter(std::uint64_t invocations, std::uint64_t most = ~std::uint64_t{0}) {
    sliceInvocations_ = invocations;
    sliceMost_ = most;
  }
  std::uint32_t sliceCount() const { return slices_; }
  // Work of all dispatches since begin(), in invocations as slices count them.
  std::uint64_t work() const { return work_; }
  // Work of the largest dispatch since begin(), in invocations as slices count them.
  std::uint64_t largestDispatch() const { return largestDispatch_; }
  // The most work of the dispatch that may become the largest.
  std::uint64_t mostOfDispatch() const { return mostOfDispatch_; }

  // Clears the recording. Earlier submissions of all its slices that were submitted must be complete.
  void begin();

  // Begins a rehearsal: the following dispatches do not run; their kernels are noted.
  void beginRehearsal();
  // One entry for each pipeline that the last rehearsal noted, in the order of their first dispatches. Valid
  // until the next rehearsal.
  std::span<const RehearsedKernel> rehearsed() const { return rehearsed_; }
  // Runs a kernel, in the forms that recordings and batches use, on no data, so that the device does its
  // first-time work now. A software device compiles the kernel then, which takes up to tenths of a second.
  void touch(const Bindings& bindings);

  // Work counts towards this stage until the next beginStage() or the end. Names need static storage. A
  // recording has at most kMaxStages names and kMaxMarks calls; repeated names add up. A timestamp costs 2 us
  // on lavapipe inline and 30 us with two threads, so that a stage should cover all substeps.
  static constexpr std::uint32_t kMaxStages = 32;
  static constexpr std::uint32_t kMaxMarks = 1024;
  // The time between two slices belongs to no stage in the first kMaxTimedSlices slices of a recording.
  static constexpr std::uint32_t kMaxTimedSlices = 512;
  void beginStage(std::string_view stage);

  // Runs the kernel on at least `threads` invocations in x, in whole workgroups; the kernel guards its
  // bounds. Throws std::runtime_error above Limits::maxDispatchX workgroups.
  template <typename Push>
  void dispatch(const Bindings& bindings, const Push& push, std::uint64_t threads) {
    static_assert(std::is_trivially_copyable_v<Push>);
    dispatchBytes(bindings, &push, sizeof(Push), threads);
  }
  void dispatch(const Bindings& bindings, std::uint64_t threads) {
    dispatchBytes(bindings, nullptr, 0, threads);
  }

  // The same for a kernel whose invocations take `work` times as long as an invocation that moves one node by
  // its springs. Slices count threads times work. If that is more than a slice, several dispatches share the
  // workgroups, without barriers between them. The kernel must not use gl_NumWorkGroups. `most`: the most
  // work that an invocation may take, if it depends on the data; 0: `work`.
  template <typename Push>
  void dispatch(const Bindings& bindings, const Push& push, std::uint64_t threads, std::uint64_t work,
                std::uint64_t most = 0) {
    static_assert(std::is_trivially_copyable_v<Push>);
    dispatchBytes(bindings, &push, sizeof(Push), threads, work, most);
  }
  // True if several dispatches would share this work.
  bool divides(const Bindings& bindings, std::uint64_t threads, std::uint64_t work) const;

  // Runs as many workgroups as three 32-bit numbers (x, y, z) in `groups` say at run time. `groups` must be a
  // buffer with purpose `indirect`. `expected` is the number of invocations that slices count for it, and
  // `most` the most work that it may have; 0: `expected`.
  template <typename Push>
  void dispatchIndirect(const Bindings& bindings, const Push& push, const Buffer& groups, std::size_t offset,
                        std::uint64_t expected, std::uint64_t most = 0) {
    static_assert(std::is_trivially_copyable_v<Push>);
    dispatchIndirectBytes(bindings, &push, sizeof(Push), groups, offset, expected, most);
  }

  // Makes earlier work (kernels, copies, fills, dispatch sizes) visible to later work. No barrier is needed
  // at the start or the end of a recording: recordings on one device always see each other's work.
  void barrier();

  void copy(const Buffer& from, const Buffer& to, std::size_t bytes, std::size_t fromOffset = 0,
            std::size_t toOffset = 0);
  // `bytes` must be a multiple of 4.
  void fill(const Buffer& buffer, std::uint32_t value, std::size_t bytes, std::size_t offset = 0);

  // Device time of each stage of the last submitted recording, in order of first appearance; after a batch,
  // the recording's part of the batch's stages. Call it when the recording is complete. Empty if the device
  // has no timestamps. Valid until the next call or begin().
  std::span<const StageTime> stageTimes();

  // Only for this folder. Writes the command buffers of a recording that is submitted alone.
  void finish();
  // Ends a recording that is submitted in a batch, and returns it.
  const Recording& endForBatch();
  // Its part of the stages of the batch.
  void setStageTimes(std::span<const StageTime> batch, double part);
  struct Handles;
  Handles& handles() const { return *handles_; }

 private:
  // A work of 0 means 1, without division.
  void dispatchBytes(const Bindings& bindings, const void* push, std::uint32_t pushBytes,
                     std::uint64_t threads, std::uint64_t work = 0, std::uint64_t most = 0);
  // Workgroups of each dispatch that shares this work, of an invocation.
  std::uint64_t groupsPerDispatch(const Kernel& kernel, std::uint64_t work, std::uint64_t most = 0) const;
  void dispatchIndirectBytes(const Bindings& bindings, const void* push, std::uint32_t pushBytes,
                             const Buffer& groups, std::size_t offset, std::uint64_t expected,
                             std::uint64_t most);
  // Counts a dispatch, and ends the slice before it if it is full.
  void count(std::uint64_t invocations, std::uint64_t most);
  void startSlice();
  void note(const Bindings& bindings, std::uint64_t invocations);
  PushRange notePush(const Kernel& kernel, const void* push, std::uint32_t pushBytes);

  const Device* device_;
  std::unique_ptr<Handles> handles_;
  Recording recording_;
  std::vector<StageTime> times_;  // of a batch
  std::vector<RehearsedKernel> rehearsed_;
  std::uint64_t sliceInvocations_ = ~std::uint64_t{0}, invocations_ = 0;  // limit, and of the current slice
  std::uint64_t sliceMost_ = ~std::uint64_t{0}, most_ = 0;                // the same of the most work
  std::uint64_t work_ = 0, largestDispatch_ = 0, mostOfDispatch_ = 0;
  std::string_view stage_;  // present one
  std::uint32_t slices_ = 0, marks_ = 0;
  std::uint32_t timedSlices_ = 0;  // slices whose start was marked
  bool inBatch_ = false;           // the last submission was a batch
  bool open_ = false, rehearses_ = false;
};

}  // namespace clothstream::vulkan
