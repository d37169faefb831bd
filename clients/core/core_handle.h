// SPDX-License-Identifier: MIT
// The handle of the C interface, and conversions that its files share.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "clients/core/client.h"
#include "clients/core/core.h"

struct cs_client {
  clothstream::client::Client client;
  std::string resumeToken{};                       // text that cs_resume_token has returned
  mutable std::vector<float> posed{};              // vertices that cs_get_hull has returned
  mutable std::vector<std::uint32_t> belowNeck{};  // corners that cs_body_below_neck has returned
};

namespace clothstream::client {

// Returns nullptr if the index is out of range.
template <typename Element>
const Element* at(const std::vector<Element>& elements, std::uint32_t index) {
  return index < elements.size() ? &elements[index] : nullptr;
}

template <typename Values, typename Number>
void copy(const Values& values, Number* out) {
  std::copy(values.begin(), values.end(), out);
}

// Whether all elements of an array of the caller have the version of this library.
template <typename Struct>
bool haveVersion(std::span<const Struct> structs, std::uint32_t version) {
  return std::all_of(structs.begin(), structs.end(),
                     [&](const Struct& one) { return one.version == version; });
}

// Returns 0 and leaves *out unchanged if `collider` is nullptr or the version is unknown, else 1.
inline int writeCollider(const Collider* collider, cs_collider* out) {
  if (!collider || out->version != CS_COLLIDER_VERSION) return 0;
  *out = {};
  out->name = collider->name.c_str();
  copy(collider->position, out->position);
  copy(collider->orientation, out->orientation);
  out->shape = collider->shape;
  out->radius = collider->radius;
  out->length = collider->length;
  copy(collider->size, out->size);
  out->yields = collider->yields ? 1 : 0;
  out->participant_id = collider->participantId;
  out->top_radius = collider->topRadius;
  return 1;
}

}  // namespace clothstream::client
