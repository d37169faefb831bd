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

// Side by side; all have the first one's names of curves, which stand below.
std::string svgOf(std::span<const LogPlot> plots);

// Throws std::runtime_error where it cannot be written.
void writeSvg(std::span<const LogPlot> plots, const std::filesystem::path& file);

}  // namespace clothstream::bench
