// SPDX-License-Identifier: MIT
#include "clients/cli/parts.h"

#include <algorithm>

#include "proto/text/printable.h"

namespace clothstream::cli {

std::vector<Part> partsOf(const cs_client* client) {
  std::vector<Part> parts;
  bool haveMaterials = false;
  cs_cloth cloth;
  for (std::uint32_t i = 0; cs_get_cloth(client, i, &cloth) != 0; ++i) {
    const std::uint32_t count = cs_submesh_count(client, i);
    cs_submesh submesh{.name = "", .first_index = cloth.first_index, .index_count = cloth.index_count};
    for (std::uint32_t k = 0; k < std::max(count, 1u); ++k) {
      if (count > 0) cs_get_submesh(client, i, k, &submesh);
      haveMaterials = haveMaterials || count > 1 || *submesh.name != '\0';
      parts.push_back({.cloth = i,
                       .clothName = printable(cloth.name),
                       .material = printable(submesh.name),
                       .firstIndex = submesh.first_index,
                       .indexCount = submesh.index_count,
                       .firstCorner = submesh.first_index - cloth.first_index});
    }
  }
  if (haveMaterials)
    for (Part& part : parts)
      if (part.material.empty()) part.material = part.clothName;
  return parts;
}

}  // namespace clothstream::cli
