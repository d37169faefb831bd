// SPDX-License-Identifier: MIT
// Recordings of several scenes in one submission.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/vulkan/command_counts.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::vulkan {

// A level of a recording is what it does between two barriers. The levels of all recordings run side by side:
// the first ones of all, then the second ones, and so on. So the device waits as often as for one recording.
// Recordings with the same shape (Recording::shape) run each kernel, copy and fill together in one dispatch,
// if the device shares kernels (Device::sharesKernels). No recording changes another one's results.
//
// Belongs to one thread at a time. Allocates no memory after its largest batch.
class Batch {
 public:
  // The device must outlive the batch.
  explicit Batch(const Device& device);
  ~Batch();
  Batch(const Batch&) = delete;
  Batch& operator=(const Batch&) = delete;

  // Clears the batch. Its earlier submission must be complete.
  void begin();
  // Adds a recording with one slice, whose submission ends with that of the batch (Device::submit). The
  // recorder must stay until shareTimes().
  void add(Recorder& recorder);
  std::size_t size() const { return members_.size(); }
  // Work of all recordings (Recorder::work).
  std::uint64_t work() const;

  // The submission is complete: gives each recording its part of the stages' times, by its work.
  void shareTimes();

  // Commands of the newest submission, without the upload of its table.
  const CommandCounts& counts() const;

  // Only for this folder (batch_handles.h). Writes the command buffers.
  void finish();
  struct Handles;
  Handles& handles() const { return *handles_; }

 private:
  struct Member {
    Recorder* recorder = nullptr;
    const Recording* recording = nullptr;
  };
  // Members with the same shape.
  struct Group {
    std::size_t first = 0, count = 0;  // in members_
    std::size_t next = 0;              // command of all of its members
  };

  void findGroups();
  // Writes the command buffers. Returns false if the table is too small.
  bool write();
  // Writes the next level of a group. Returns whether there are more. `times`: marks its stages.
  bool writeLevel(Group& group, bool times);
  void writeCommand(const Group& group, std::size_t command);
  template <typename One>
  const One& commandOf(std::size_t member, std::size_t command) const;
  bool shareDispatch(const Group& group, std::size_t command);
  bool shareMove(const Group& group, std::size_t command);

  const Device* device_;
  std::unique_ptr<Handles> handles_;
  std::vector<Member> members_;  // in groups, once they are found
  std::vector<Group> groups_;
};

}  // namespace clothstream::vulkan
