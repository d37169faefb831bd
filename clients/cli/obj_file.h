// SPDX-License-Identifier: MIT
// The cloths of a client as a Wavefront OBJ file.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "clients/core/core.h"
#include "clients/files/new_file.h"

namespace clothstream::cli {

// Positions and normals of the newest frame, a group for each cloth; finishes the file. The error is the
// file's.
[[nodiscard]] tl::expected<void, std::string> writeObj(const cs_client* client, files::NewFile& file);

}  // namespace clothstream::cli
