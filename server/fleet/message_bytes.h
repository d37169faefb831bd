// SPDX-License-Identifier: MIT
// Protobuf messages as bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <google/protobuf/message_lite.h>

#include "server/delivery/envelope.h"

namespace clothstream::fleet {

inline bool parse(std::span<const std::byte> bytes, google::protobuf::MessageLite& message) {
  return message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

inline delivery::SharedBytes toBytes(const google::protobuf::MessageLite& message) {
  auto bytes = std::make_shared<std::vector<std::byte>>(message.ByteSizeLong());
  message.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(bytes->data()));
  return bytes;
}

}  // namespace clothstream::fleet
