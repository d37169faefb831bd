// SPDX-License-Identifier: MIT
// Frames of a recording as arrays of numpy.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "clients/cli/error.h"
#include "clients/files/npz_writer.h"
#include "clients/recording/played_recording.h"

namespace clothstream::cli {

// docs/recording.md lists the arrays.
class NpzExport {
 public:
  // `played` must not have a frame yet, because the client shows the rest state until then. `path` must not
  // exist.
  [[nodiscard]] static tl::expected<NpzExport, Error> begin(const std::string& path,
                                                            const client::PlayedRecording& played);
  // Adds the newest frame.
  [[nodiscard]] tl::expected<void, Error> add(const client::PlayedRecording& played);
  [[nodiscard]] tl::expected<void, Error> finish();

 private:
  explicit NpzExport(files::NpzWriter writer) : writer_(std::move(writer)) {}

  files::NpzWriter writer_;
  // Numbers of the arrays that grow with each frame.
  std::size_t ticks_ = 0, seconds_ = 0, positions_ = 0, normals_ = 0, reconstructionHashes_ = 0,
              stateHashes_ = 0;
};

}  // namespace clothstream::cli
