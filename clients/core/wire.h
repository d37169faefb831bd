// SPDX-License-Identifier: MIT
// Reading protobuf messages from outside: structure is checked before protozero reads, so that it cannot
// throw.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <protozero/pbf_reader.hpp>

namespace clothstream::client {

using Bytes = protozero::data_view;
using Reader = protozero::pbf_reader;

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
  Reader reader(message);
  while (reader.next()) {
    if (!visit(reader.tag_and_type(), reader)) return false;
  }
  return true;
}

// Appends the varints of a packed field, each to its lower 32 bits. False where the bytes are no whole
// varints, or `out` would hold more than `max`.
[[nodiscard]] bool readPackedVarints(Bytes packed, std::size_t max, std::vector<std::uint32_t>& out);

// nullopt unless every field was read.
template <typename Message, typename Visit>
[[nodiscard]] std::optional<Message> readMessage(Bytes bytes, Visit&& visit) {
  std::optional<Message> message(std::in_place);
  const auto visitField = [&](std::uint32_t field, Reader& reader) { return visit(*message, field, reader); };
  if (!readFields(bytes, visitField)) message.reset();
  return message;
}

template <typename Value>
bool set(Value& target, Value value) {
  target = value;
  return true;
}

// False of what is not finite.
inline bool setFinite(float& target, Reader& reader) {
  target = reader.get_float();
  return std::isfinite(target);
}

inline bool setFinite(std::optional<float>& target, Reader& reader) {
  return setFinite(target.emplace(), reader);
}

inline bool setText(std::string& target, Reader& reader) {
  const Bytes view = reader.get_view();
  target.assign(view.data(), view.size());
  return true;
}

inline bool skip(Reader& reader) {
  reader.skip();
  return true;
}

}  // namespace clothstream::client
