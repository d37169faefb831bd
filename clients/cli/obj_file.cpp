// SPDX-License-Identifier: MIT
// Formats vertices, normals, texture coordinates, and groups of faces.
#include "clients/cli/obj_file.h"

#include <iterator>
#include <optional>
#include <span>
#include <vector>

#include <fmt/format.h>

#include "clients/cli/parts.h"

namespace clothstream::cli {
namespace {

void appendTriples(std::string& text, const char* keyword, const float* values, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i)
    fmt::format_to(std::back_inserter(text), "{} {} {} {}\n", keyword, values[3 * i], values[3 * i + 1],
                   values[3 * i + 2]);
}

void appendUvs(std::string& text, const float* uvs, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i)
    fmt::format_to(std::back_inserter(text), "vt {} {}\n", uvs[2 * i], uvs[2 * i + 1]);
}

// OBJ indices start at 1. A vertex and its normal have the same index. `uvs` has an index for each corner,
// and `firstUv` is the index in the file of the first texture coordinate of the cloth. Null: there are none.
void appendFaces(std::string& text, std::span<const std::uint32_t> corners, const std::uint32_t* uvs,
                 std::uint32_t firstUv) {
  const auto out = std::back_inserter(text);
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    text += 'f';
    for (std::size_t k = i; k < i + 3; ++k)
      if (uvs)
        fmt::format_to(out, " {0}/{1}/{0}", corners[k] + 1, firstUv + uvs[k]);
      else
        fmt::format_to(out, " {0}//{0}", corners[k] + 1);
    text += '\n';
  }
}

// One group per cloth, with the parts as materials.
void appendCloths(std::string& text, const cs_client* client) {
  std::uint32_t indexCount = 0, uvCount = 0;
  const std::uint32_t* indices = cs_triangles(client, &indexCount);
  std::vector<std::uint32_t> firstUv;  // of each cloth
  cs_cloth cloth;
  for (std::uint32_t i = 0, next = 1; cs_get_cloth(client, i, &cloth) != 0; ++i, next += uvCount) {
    firstUv.push_back(next);
    const float* uvs = cs_uvs(client, i, &uvCount);
    appendUvs(text, uvs, uvCount);
  }
  std::optional<std::uint32_t> group;
  for (const Part& part : partsOf(client)) {
    if (group != part.cloth) fmt::format_to(std::back_inserter(text), "g {}\n", part.clothName);
    group = part.cloth;
    if (!part.material.empty()) fmt::format_to(std::back_inserter(text), "usemtl {}\n", part.material);
    const std::uint32_t* uvs = cs_uv_indices(client, part.cloth, &uvCount);
    appendFaces(text, {indices + part.firstIndex, part.indexCount}, uvs ? uvs + part.firstCorner : nullptr,
                firstUv[part.cloth]);
  }
}

std::string objText(const cs_client* client) {
  std::string text;
  const std::uint32_t vertices = cs_vertex_count(client);
  cs_statistics statistics;
  cs_get_statistics(client, 0, &statistics);
  fmt::format_to(std::back_inserter(text), "# scene {}, tick {}; metres, +Y up\n", cs_scene_name(client),
                 statistics.tick);
  appendTriples(text, "v", cs_positions(client), vertices);
  appendTriples(text, "vn", cs_normals(client), vertices);
  appendCloths(text, client);
  return text;
}

}  // namespace

tl::expected<void, std::string> writeObj(const cs_client* client, files::NewFile& file) {
  return file.write(objText(client)).and_then([&] { return file.finish(); });
}

}  // namespace clothstream::cli
