// SPDX-License-Identifier: MIT
// Memory of a message, known before it is parsed.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include <google/protobuf/descriptor.h>

namespace clothstream::messages {

// Upper bound in bytes of the memory that a parsed message of this type needs, its input not included. A few
// bytes of input can become a hundred in memory, such as an empty element of a repeated field. Reads the
// input once and allocates almost nothing. Returns nothing if the bound exceeds `limit`, if `bytes` is not
// such a message, or if it is nested deeper than the parser permits.
[[nodiscard]] std::optional<std::size_t> parsedSize(const google::protobuf::Descriptor& type,
                                                    std::span<const std::byte> bytes, std::size_t limit);

}  // namespace clothstream::messages
