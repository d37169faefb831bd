// SPDX-License-Identifier: MIT
// What the parameters were at any time of a recording, without reading it from its start.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "proto/recording/recording_reader.h"
#include "server/recording/parameters_in_force.h"

namespace clothstream::recording {

// Keeps all parameters as they were before a chunk that holds changes, for each such chunk, or, where these
// were more than kMaxBytes, for one of so many. What comes next from a reader stays what it was.
class ParameterHistory {
 public:
  static constexpr std::size_t kMaxBytes = std::size_t{32} << 20;

  // Reads every chunk that holds changes. What is in chunks that cannot be read is left out.
  ParameterHistory(RecordingReader& reader, const v1::StreamDescription& description,
                   std::size_t maxBytes = kMaxBytes);

  // All parameters as they are known to whoever saw everything up to this time, ns. Of the same recording.
  ParametersInForce at(std::uint64_t time, RecordingReader& reader) const;

  // How many chunks at() reads at most.
  std::size_t stride() const { return stride_; }

 private:
  void keep(const ParametersInForce& parameters, std::size_t maxBytes);

  std::vector<std::size_t> chunks_;  // that hold changes
  std::size_t stride_ = 1;
  std::vector<std::string> kept_;  // serialised, of before the chunks 0, stride, 2 stride, ... of these
  std::size_t bytes_ = 0;          // kept
};

}  // namespace clothstream::recording
