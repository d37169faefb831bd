// SPDX-License-Identifier: MIT
// Drawings to pixels.
#pragma once

#include <filesystem>
#include <string>

namespace clothstream::bench {

// An SVG text as a PNG file, two pixels a unit. Throws std::runtime_error where it is no drawing or cannot be
// written.
void writePng(const std::string& svg, const std::filesystem::path& file);

}  // namespace clothstream::bench
