// SPDX-License-Identifier: MIT
// Checks the structure of protobuf messages that are not trusted. After the check protozero never throws.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include <protozero/types.hpp>

namespace clothstream {

// Reads a message from its front, and never past its end.
class MessageCursor {
 public:
  explicit MessageCursor(std::string_view message)
      : at_(message.data()), end_(message.data() + message.size()) {}

  bool atEnd() const { return at_ == end_; }

  // nullopt if the varint is incomplete or has more than ten bytes.
  std::optional<std::uint64_t> varintValue() {
    std::uint64_t value = 0;
    for (unsigned shift = 0; shift < 70; shift += 7) {
      if (at_ == end_) return std::nullopt;
      const auto byte = static_cast<std::uint8_t>(*at_++);
      value |= std::uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) return value;
    }
    return std::nullopt;
  }

  bool advance(std::uint64_t count) {
    if (count > static_cast<std::uint64_t>(end_ - at_)) return false;
    at_ += count;
    return true;
  }

  bool skipValue(std::uint64_t wireType) {
    switch (static_cast<protozero::pbf_wire_type>(wireType)) {
      case protozero::pbf_wire_type::varint:
        return varintValue().has_value();
      case protozero::pbf_wire_type::fixed64:
        return advance(8);
      case protozero::pbf_wire_type::length_delimited: {
        const std::optional<std::uint64_t> length = varintValue();
        return length && advance(*length);
      }
      case protozero::pbf_wire_type::fixed32:
        return advance(4);
      default:
        return false;
    }
  }

 private:
  const char* at_;
  const char* end_;
};

// Whether the bytes are a sequence of complete fields: a tag with a valid number and a proto3 wire type,
// varints of at most ten bytes, lengths within the message. Submessages are not checked.
[[nodiscard]] inline bool wellFormed(std::string_view message) {
  // Zero and the numbers that protobuf reserves for itself are not valid.
  const auto isFieldNumber = [](std::uint64_t number) {
    return number != 0 && (number < 19000 || number > 19999);
  };
  MessageCursor cursor(message);
  while (!cursor.atEnd()) {
    const std::optional<std::uint64_t> tag = cursor.varintValue();
    if (!tag || *tag > std::numeric_limits<std::uint32_t>::max() || !isFieldNumber(*tag >> 3)) return false;
    if (!cursor.skipValue(*tag & 7)) return false;
  }
  return true;
}

}  // namespace clothstream
