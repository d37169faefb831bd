// SPDX-License-Identifier: MIT
// Description of a recorded stream as a protobuf message.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/stream_layout.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::recording {

// Parses RecordingReader::description(). The error says if its cloths exceed the limits of the reader.
[[nodiscard]] tl::expected<v1::StreamDescription, std::string> readDescription(RecordingReader& reader);

// Says how the cloths exceed the limits; empty if they do not.
std::string sizeProblemOf(const v1::StreamDescription& description, const ReadLimits& limits);

// Layout of the stream that a decoder is made with. It may be impossible (codec::isPossible).
codec::StreamLayout layoutOf(const v1::StreamDescription& description);

}  // namespace clothstream::recording
