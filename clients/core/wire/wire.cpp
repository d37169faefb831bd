// SPDX-License-Identifier: MIT
// Checks the structure of protobuf messages and reads packed varints.
#include "clients/core/wire/wire.h"

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

namespace clothstream::client {
namespace {

class Cursor {
 public:
  explicit Cursor(Bytes message) : at_(message.data()), end_(message.data() + message.size()) {}

  bool atEnd() const { return at_ == end_; }

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

 private:
  const char* at_;
  const char* end_;
};

// Zero and the numbers that protobuf reserves for itself are not valid.
bool isFieldNumber(std::uint64_t number) {
  return number != 0 && (number < 19000 || number > 19999);
}

bool skipValue(Cursor& cursor, std::uint64_t wireType) {
  switch (static_cast<protozero::pbf_wire_type>(wireType)) {
    case protozero::pbf_wire_type::varint:
      return cursor.varintValue().has_value();
    case protozero::pbf_wire_type::fixed64:
      return cursor.advance(8);
    case protozero::pbf_wire_type::length_delimited: {
      const std::optional<std::uint64_t> length = cursor.varintValue();
      return length && cursor.advance(*length);
    }
    case protozero::pbf_wire_type::fixed32:
      return cursor.advance(4);
    default:
      return false;
  }
}

}  // namespace

bool wellFormed(Bytes message) {
  Cursor cursor(message);
  while (!cursor.atEnd()) {
    const std::optional<std::uint64_t> tag = cursor.varintValue();
    if (!tag || *tag > std::numeric_limits<std::uint32_t>::max() || !isFieldNumber(*tag >> 3)) return false;
    if (!skipValue(cursor, *tag & 7)) return false;
  }
  return true;
}

bool readPackedVarints(Bytes packed, std::size_t max, std::vector<std::uint32_t>& out) {
  Cursor cursor(packed);
  while (!cursor.atEnd()) {
    const std::optional<std::uint64_t> value = cursor.varintValue();
    if (!value || out.size() == max) return false;
    out.push_back(static_cast<std::uint32_t>(*value));
  }
  return true;
}

}  // namespace clothstream::client
