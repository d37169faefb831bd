// SPDX-License-Identifier: MIT
// Rasterises drawings.
#pragma once

#include <filesystem>
#include <string>

namespace clothstream::bench {

// Writes an SVG text as a PNG file with two pixels a unit. Throws std::runtime_error if the text is no
// drawing or the file cannot be written.
void writePng(const std::string& svg, const std::filesystem::path& file);

}  // namespace clothstream::bench
