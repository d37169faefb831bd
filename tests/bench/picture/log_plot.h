// SPDX-License-Identifier: MIT
// Curves over two logarithmic axes, as SVG.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace clothstream::bench {

struct LogPlot {
  struct Curve {
    std::string name;
    std::vector<std::pair<double, double>> points;  // above 0
  };
  std::string title, across, up;
  std::vector<Curve> curves;
};

// Draws the plots side by side. All have the same curves; the legend below shows the names of the first
// plot's.
std::string svgOf(std::span<const LogPlot> plots);

// Throws std::runtime_error if the file cannot be written.
void writeSvg(std::span<const LogPlot> plots, const std::filesystem::path& file);

}  // namespace clothstream::bench
