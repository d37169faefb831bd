// SPDX-License-Identifier: MIT
// What the C interface's handle points to, and what the files of that interface share.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "clients/core/client.h"
#include "clients/core/core.h"

struct cs_client {
  clothstream::client::Client client;
};

namespace clothstream::client {

// The element, or nullptr where there is none.
template <typename Element>
const Element* at(const std::vector<Element>& elements, std::uint32_t index) {
  return index < elements.size() ? &elements[index] : nullptr;
}

template <typename Values>
void copy(const Values& values, float* out) {
  std::copy(values.begin(), values.end(), out);
}

// 0 where there is none.
inline int writeCollider(const Collider* collider, cs_collider* out) {
  if (!collider) return 0;
  *out = {};
  out->name = collider->name.c_str();
  copy(collider->position, out->position);
  copy(collider->orientation, out->orientation);
  out->shape = collider->shape;
  out->radius = collider->radius;
  out->length = collider->length;
  copy(collider->size, out->size);
  out->participant_id = collider->participantId;
  return 1;
}

}  // namespace clothstream::client
