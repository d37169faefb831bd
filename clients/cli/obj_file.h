// SPDX-License-Identifier: MIT
// Writes the cloths of a client as a Wavefront OBJ file.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "clients/core/core.h"
#include "clients/files/new_file.h"

namespace clothstream::cli {

// Writes positions and normals of the newest frame with one group per cloth, and finishes the file. Parts of
// meshes are materials (usemtl), without a material file, and texture coordinates are written where the
// stream has them. Errors as in NewFile.
[[nodiscard]] tl::expected<void, std::string> writeObj(const cs_client* client, files::NewFile& file);

}  // namespace clothstream::cli
