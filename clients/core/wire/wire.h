// SPDX-License-Identifier: MIT
// Reads protobuf messages that are not trusted. The structure is checked before protozero reads, so protozero
// never throws. Field numbers are in field_numbers.h.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <protozero/pbf_reader.hpp>

#include "clients/core/wire/field_numbers.h"
#include "proto/text/utf8.h"
#include "proto/wire/message_structure.h"

namespace clothstream::client {

using Bytes = protozero::data_view;
using Reader = protozero::pbf_reader;
using Vec3 = std::array<float, 3>;

[[nodiscard]] inline bool wellFormed(Bytes message) {
  return clothstream::wellFormed(std::string_view(message.data(), message.size()));
}

// Field number with a wire type, as on the wire. A known number with an unexpected wire type does not match,
// so it is skipped like an unknown field.
constexpr std::uint32_t varint(std::uint32_t number) {
  return protozero::tag_and_type(number, protozero::pbf_wire_type::varint);
}
constexpr std::uint32_t fixed32(std::uint32_t number) {
  return protozero::tag_and_type(number, protozero::pbf_wire_type::fixed32);
}
constexpr std::uint32_t fixed64(std::uint32_t number) {
  return protozero::tag_and_type(number, protozero::pbf_wire_type::fixed64);
}
constexpr std::uint32_t bytes(std::uint32_t number) {
  return protozero::tag_and_type(number, protozero::pbf_wire_type::length_delimited);
}

// Calls `visit(tag, reader)` for each field. The visitor reads or skips the value, and returns false to
// refuse the message. Returns false if the message is not well formed or was refused.
template <typename Visit>
[[nodiscard]] bool readFields(Bytes message, Visit&& visit) {
  if (!wellFormed(message)) return false;
  Reader reader(message);
  while (reader.next()) {
    if (!visit(reader.tag_and_type(), reader)) return false;
  }
  return true;
}

// Reads the fields into a new Message with `visit(message, tag, reader)`. nullopt if readFields fails.
template <typename Message, typename Visit>
[[nodiscard]] std::optional<Message> readMessage(Bytes bytes, Visit&& visit) {
  std::optional<Message> message(std::in_place);
  const auto visitField = [&](std::uint32_t tag, Reader& reader) { return visit(*message, tag, reader); };
  if (!readFields(bytes, visitField)) message.reset();
  return message;
}

// Appends the varints of a packed field, each truncated to 32 bits. Returns false if the last varint is
// incomplete or `out` would exceed `max` elements.
[[nodiscard]] bool readPackedVarints(Bytes packed, std::size_t max, std::vector<std::uint32_t>& out);

// The setters below return whether the value is allowed, so that a visitor can return their result.

template <typename Value>
bool set(Value& target, Value value) {
  target = value;
  return true;
}

// Returns false if the float is not finite.
inline bool setFinite(float& target, Reader& reader) {
  target = reader.get_float();
  return std::isfinite(target);
}

inline bool setFinite(std::optional<float>& target, Reader& reader) {
  return setFinite(target.emplace(), reader);
}

// Returns false if the double is not finite.
inline bool setFinite(double& target, Reader& reader) {
  target = reader.get_double();
  return std::isfinite(target);
}

inline bool setBytes(std::string& target, Reader& reader) {
  const Bytes view = reader.get_view();
  target.assign(view.data(), view.size());
  return true;
}

// Returns false, and leaves the target, if the text is not UTF-8.
inline bool setText(std::string& target, Reader& reader) {
  const Bytes view = reader.get_view();
  if (!isUtf8({view.data(), view.size()})) return false;
  target.assign(view.data(), view.size());
  return true;
}

inline bool skip(Reader& reader) {
  reader.skip();
  return true;
}

// Reads a message whose fields 1 to N are floats: Vec3, Quaternion or Spring. Missing floats are 0. Returns
// false if the message is not well formed or a float is not finite.
template <std::size_t N>
[[nodiscard]] bool readFloats(Bytes message, std::array<float, N>& out) {
  static_assert(field::Vec3::kX.number == 1 && field::Vec3::kZ.number == 3);
  static_assert(field::Quaternion::kX.number == 1 && field::Quaternion::kW.number == 4);
  static_assert(field::Spring::kStiffness.number == 1 && field::Spring::kDamping.number == 2);
  out = {};
  return readFields(message, [&](std::uint32_t tag, Reader& reader) {
    for (std::uint32_t i = 0; i < N; ++i) {
      if (tag == fixed32(i + 1)) return setFinite(out[i], reader);
    }
    return skip(reader);
  });
}

inline bool readVec3(Bytes message, Vec3& out) {
  return readFloats(message, out);
}

}  // namespace clothstream::client
