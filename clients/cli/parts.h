// SPDX-License-Identifier: MIT
// Parts of the cloths of a client, as exported files have them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/core/core.h"

namespace clothstream::cli {

struct Part {
  std::uint32_t cloth = 0;  // index
  std::string clothName;
  std::string material;                          // name; empty if no cloth of the stream has parts
  std::uint32_t firstIndex = 0, indexCount = 0;  // in cs_triangles
  std::uint32_t firstCorner = 0;                 // of `firstIndex` in cs_uv_indices of the cloth
};

// All parts in the order of their triangles, with printable names. A cloth without parts is one part. If a
// cloth has parts, each part has a material, so that readers of OBJ do not take that of the part before: a
// part without a name gets that of its cloth.
std::vector<Part> partsOf(const cs_client* client);

}  // namespace clothstream::cli
