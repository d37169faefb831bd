// SPDX-License-Identifier: MIT
// Description of a recorded stream as a protobuf message.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::recording {

// Parses RecordingReader::description().
[[nodiscard]] tl::expected<v1::StreamDescription, std::string> readDescription(RecordingReader& reader);

}  // namespace clothstream::recording
