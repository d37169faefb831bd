// SPDX-License-Identifier: MIT
// Protobuf type of each channel's messages.
#pragma once

#include <string_view>

#include <google/protobuf/descriptor.h>

#include "proto/recording/topics.h"

namespace clothstream::recording {

const google::protobuf::Descriptor& typeOf(Topic topic);
// Whether the bytes are a message of the channel's type.
[[nodiscard]] bool isReadable(Topic topic, std::string_view bytes);

}  // namespace clothstream::recording
