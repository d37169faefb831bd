// SPDX-License-Identifier: MIT
// The most vertices that a client accepts from its server, as the option --max-vertices gives it.
#pragma once

#include <cstdint>

#include "clients/core/core.h"

namespace clothstream {

// Lets the client accept `vertices` vertices and twice as many triangles; at most 67,108,864 vertices. 0: the
// defaults of cs_limits stay.
inline void limitVertices(cs_client* client, std::uint32_t vertices) {
  if (vertices == 0) return;
  cs_limits limits;
  cs_default_limits(&limits);
  limits.max_vertices = vertices;
  limits.max_triangles = 2 * vertices;
  cs_set_limits(client, &limits);
}

}  // namespace clothstream
