// SPDX-License-Identifier: MIT
// Formats vertices, normals and groups of faces.
#include "clients/cli/obj_file.h"

#include <iterator>

#include <fmt/format.h>

namespace clothstream::cli {
namespace {

void appendTriples(std::string& text, const char* keyword, const float* values, std::uint32_t count) {
  for (std::uint32_t i = 0; i < count; ++i)
    fmt::format_to(std::back_inserter(text), "{} {} {} {}\n", keyword, values[3 * i], values[3 * i + 1],
                   values[3 * i + 2]);
}

// OBJ indices start at 1. A vertex and its normal have the same index.
void appendFaces(std::string& text, const std::uint32_t* indices, std::uint32_t count) {
  for (std::uint32_t i = 0; i + 2 < count; i += 3)
    fmt::format_to(std::back_inserter(text), "f {0}//{0} {1}//{1} {2}//{2}\n", indices[i] + 1,
                   indices[i + 1] + 1, indices[i + 2] + 1);
}

std::string objText(const cs_client* client) {
  std::string text;
  const std::uint32_t vertices = cs_vertex_count(client);
  std::uint32_t indexCount = 0;
  const std::uint32_t* indices = cs_triangles(client, &indexCount);
  cs_statistics statistics;
  cs_get_statistics(client, 0, &statistics);
  fmt::format_to(std::back_inserter(text), "# scene {}, tick {}; metres, +Y up\n", cs_scene_name(client),
                 statistics.tick);
  appendTriples(text, "v", cs_positions(client), vertices);
  appendTriples(text, "vn", cs_normals(client), vertices);
  cs_cloth cloth;
  for (std::uint32_t i = 0; cs_get_cloth(client, i, &cloth) != 0; ++i) {
    fmt::format_to(std::back_inserter(text), "g {}\n", cloth.name);
    appendFaces(text, indices + cloth.first_index, cloth.index_count);
  }
  return text;
}

}  // namespace

tl::expected<void, std::string> writeObj(const cs_client* client, files::NewFile& file) {
  return file.write(objText(client)).and_then([&] { return file.finish(); });
}

}  // namespace clothstream::cli
