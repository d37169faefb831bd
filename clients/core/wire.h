// SPDX-License-Identifier: MIT
// Reading protobuf messages from outside: structure is checked before protozero reads, so that it cannot
// throw.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <protozero/pbf_reader.hpp>

namespace clothstream::client {

using Bytes = protozero::data_view;

// Whether the bytes are a row of fields, each whole: a tag with a valid number and a wire type of proto3,
// varints of at most ten bytes, lengths within the message. Submessages are not looked into.
[[nodiscard]] bool wellFormed(Bytes message);

// Matches a field number with its wire type: a known number with another type is skipped like an unknown
// field.
constexpr std::uint32_t varint(std::uint32_t field) {
  return protozero::tag_and_type(field, protozero::pbf_wire_type::varint);
}
constexpr std::uint32_t fixed32(std::uint32_t field) {
  return protozero::tag_and_type(field, protozero::pbf_wire_type::fixed32);
}
constexpr std::uint32_t fixed64(std::uint32_t field) {
  return protozero::tag_and_type(field, protozero::pbf_wire_type::fixed64);
}
constexpr std::uint32_t bytes(std::uint32_t field) {
  return protozero::tag_and_type(field, protozero::pbf_wire_type::length_delimited);
}

// Calls `visit(tagAndType, reader)` at each field; it reads the value or skips it, and returns false to
// refuse the message. False where the message is not well formed or was refused.
template <typename Visit>
[[nodiscard]] bool readFields(Bytes message, Visit&& visit) {
  if (!wellFormed(message)) return false;
  protozero::pbf_reader reader(message);
  while (reader.next()) {
    if (!visit(reader.tag_and_type(), reader)) return false;
  }
  return true;
}

// Appends the varints of a packed field, each to its lower 32 bits. False where the bytes are no whole
// varints, or `out` would hold more than `max`.
[[nodiscard]] bool readPackedVarints(Bytes packed, std::size_t max, std::vector<std::uint32_t>& out);

inline bool setText(std::string& target, protozero::pbf_reader& reader) {
  const Bytes view = reader.get_view();
  target.assign(view.data(), view.size());
  return true;
}

inline bool skip(protozero::pbf_reader& reader) {
  reader.skip();
  return true;
}

}  // namespace clothstream::client
