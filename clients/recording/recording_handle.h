// SPDX-License-Identifier: MIT
// The handle of the C interface.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include <clothstream/recording.h>

#include "clients/recording/played_recording.h"
#include "proto/recording/byte_source.h"

struct cs_recording {
  std::optional<clothstream::client::PlayedRecording> played{};
  std::string errorText{};
  std::string_view message{};  // serialised bytes of the newest message
};

namespace clothstream::client {

// `name` is for error messages. `maxVertices` as in recording.h.
cs_recording* openRecording(tl::expected<std::unique_ptr<recording::ByteSource>, std::string> source,
                            std::string name, std::uint32_t maxVertices);

}  // namespace clothstream::client
