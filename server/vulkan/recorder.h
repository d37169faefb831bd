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

namespace clothstream::vulkan {

struct StageTime {
  std::string_view stage;  // as passed to beginStage; static storage
  double seconds = 0;
};

// One command buffer and its timestamps, used again and again. Belongs to one thread at a time. Allocates
// nothing once it has recorded its longest recording.
class Recorder {
 public:
  explicit Recorder(const Device& device);
  ~Recorder();
  Recorder(Recorder&&) noexcept;
  Recorder& operator=(Recorder&&) noexcept;

  // Forgets what was recorded; what was submitted must be complete.
  void begin();

  // As begin(), but what follows runs no kernels: they are noted.
  void beginRehearsal();
  // Of each kernel that the last rehearsal noted, what it was bound to first. Good until the next rehearsal.
  std::span<const Bindings* const> rehearsed() const { return rehearsed_; }
  // Runs a kernel on nothing: what a device does when one first runs, it does then. Software devices compile
  // it, which takes up to tenths of a second.
  void touch(const Bindings& bindings);

  // Until the next beginStage or the end, work counts to this stage (names in static storage; at most
  // kMaxStages names and kMaxMarks calls a recording; the same name may come again and is added up).
  // A time stamp costs 2 us on lavapipe inline and 30 us with two threads: a stage is all substeps, not each
  // of them.
  static constexpr std::uint32_t kMaxStages = 32;
  static constexpr std::uint32_t kMaxMarks = 1024;
  void beginStage(std::string_view stage);

  // Runs the kernel on at least `threads` invocations in x (whole workgroups: the kernel guards its bounds).
  // Throws std::runtime_error where that is more than Limits::maxDispatchX workgroups.
  template <typename Push>
  void dispatch(const Bindings& bindings, const Push& push, std::uint64_t threads) {
    static_assert(std::is_trivially_copyable_v<Push>);
    dispatchBytes(bindings, &push, sizeof(Push), threads);
  }
  void dispatch(const Bindings& bindings, std::uint64_t threads) {
    dispatchBytes(bindings, nullptr, 0, threads);
  }

  // As many workgroups as three 32-bit numbers (x, y, z) in `groups`, a buffer made as `indirect`, say when
  // it runs.
  template <typename Push>
  void dispatchIndirect(const Bindings& bindings, const Push& push, const Buffer& groups,
                        std::size_t offset = 0) {
    static_assert(std::is_trivially_copyable_v<Push>);
    dispatchIndirectBytes(bindings, &push, sizeof(Push), groups, offset);
  }

  // What comes after sees what came before: kernels, copies, fills, dispatch sizes. None is needed at the
  // start or the end of a recording: recordings on one device always see each other's work.
  void barrier();

  void copy(const Buffer& from, const Buffer& to, std::size_t bytes, std::size_t fromOffset = 0,
            std::size_t toOffset = 0);
  // `bytes` a multiple of 4.
  void fill(const Buffer& buffer, std::uint32_t value, std::size_t bytes, std::size_t offset = 0);

  // Device seconds of each stage of the last submitted recording, in order of first appearance; call when it
  // is complete. Empty where the device has no timestamps. Good until the next call or begin().
  std::span<const StageTime> stageTimes();

  // For this room alone (handles.h): ends the recording with a barrier towards the host and later recordings.
  void finish();
  struct Handles;
  const Handles& handles() const { return *handles_; }

 private:
  void dispatchBytes(const Bindings& bindings, const void* push, std::uint32_t pushBytes,
                     std::uint64_t threads);
  void dispatchIndirectBytes(const Bindings& bindings, const void* push, std::uint32_t pushBytes,
                             const Buffer& groups, std::size_t offset);
  void note(const Bindings& bindings);
  void bind(const Bindings& bindings, const void* push, std::uint32_t pushBytes);
  void mark();

  const Device* device_;
  std::unique_ptr<Handles> handles_;
  std::uint64_t timestampMask_ = 0;
  std::vector<std::string_view> marks_;
  std::vector<std::uint64_t> ticks_;
  std::vector<StageTime> times_;
  std::vector<const Bindings*> rehearsed_;
  bool open_ = false, rehearses_ = false;
};

}  // namespace clothstream::vulkan
