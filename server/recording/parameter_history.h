// SPDX-License-Identifier: MIT
// Parameters at any time of a recording, without reading it from its start.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "proto/recording/recording_reader.h"
#include "server/recording/parameters_in_force.h"

namespace clothstream::recording {

// Keeps a snapshot of all parameters from before each chunk that holds changes. If the snapshots exceed
// kMaxBytes, only every stride-th one is kept. Reading does not move the position of the reader.
class ParameterHistory {
 public:
  static constexpr std::size_t kMaxBytes = std::size_t{32} << 20;

  // Reads every chunk that holds changes. Ignores chunks that cannot be read.
  ParameterHistory(RecordingReader& reader, const v1::StreamDescription& description,
                   std::size_t maxBytes = kMaxBytes);

  // All parameters after every change up to `time`, ns. `reader` must read the same recording.
  ParametersInForce at(std::uint64_t time, RecordingReader& reader) const;

  // Maximum number of chunks that at() reads.
  std::size_t stride() const { return stride_; }

 private:
  void keep(const ParametersInForce& parameters, std::size_t maxBytes);

  std::vector<std::size_t> chunks_;  // chunks that hold changes
  std::size_t stride_ = 1;
  // Serialised snapshots from before the chunks 0, stride, 2 stride, ... of these.
  std::vector<std::string> kept_;
  std::size_t bytes_ = 0;  // size of the snapshots
};

}  // namespace clothstream::recording
