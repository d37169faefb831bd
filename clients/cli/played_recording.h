// SPDX-License-Identifier: MIT
// Plays a recorded stream in a client, frame by frame.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <tl/expected.hpp>

#include "clients/core/core.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

class PlayedRecording {
 public:
  // The error describes the problem.
  [[nodiscard]] static tl::expected<PlayedRecording, std::string> open(recording::RecordingReader reader);

  // Continues to the next frame that can be decoded. Returns false at the end. cs_get_statistics() counts the
  // others.
  [[nodiscard]] tl::expected<bool, std::string> next();

  const cs_client* client() const { return client_.get(); }
  const recording::RecordingReader& reader() const { return reader_; }
  // Time of the newest frame since the start of the recording, s.
  double seconds() const { return static_cast<double>(time_ - reader_.start()) * 1e-9; }

 private:
  PlayedRecording(recording::RecordingReader reader, std::unique_ptr<cs_client, decltype(&cs_destroy)> client)
      : reader_(std::move(reader)), client_(std::move(client)) {}

  recording::RecordingReader reader_;
  std::unique_ptr<cs_client, decltype(&cs_destroy)> client_;
  std::uint64_t time_ = 0;
};

}  // namespace clothstream::cli
