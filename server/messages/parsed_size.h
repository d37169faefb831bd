// SPDX-License-Identifier: MIT
// Memory of a message, known before it is parsed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <google/protobuf/descriptor.h>
#include <tl/expected.hpp>

namespace clothstream::messages {

enum class SizeError : std::uint8_t {
  malformed,  // not such a message, or nested deeper than the parser permits
  tooLarge,   // the bound exceeds the limit
};

// Upper bound in bytes of the memory that a parsed message of this type needs, its input not included. A few
// bytes of input can become a hundred in memory, such as an empty element of a repeated field. Reads the
// input once, up to the first error, and allocates almost nothing.
[[nodiscard]] tl::expected<std::size_t, SizeError> parsedSize(const google::protobuf::Descriptor& type,
                                                              std::span<const std::byte> bytes,
                                                              std::size_t limit);

}  // namespace clothstream::messages
