// SPDX-License-Identifier: MIT
// Curves over two logarithmic axes, as SVG.
#include "tests/bench/picture/log_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

namespace clothstream::bench {
namespace {

constexpr int kWidth = 330, kHeight = 300, kLeft = 52, kBottom = 44, kTop = 28, kRight = 12, kLegend = 44,
              kLegendRow = 18;
constexpr std::array kColours{"#1b6ca8", "#3aa6d0", "#7a4fa3", "#d1495b", "#2e8b57", "#c98a1b", "#666666"};

// An axis between two pixels, with grid lines that enclose all values: at whole decades or, if there are few,
// at 1, 2 and 5 of each.
struct Axis {
  double least = std::numeric_limits<double>::max(), most = 0;
  double from = 0, to = 0;

  void include(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
  }
  std::vector<double> lines() const {
    const bool few = most < 100 * least;
    std::vector<double> all;
    for (int decade = static_cast<int>(std::floor(std::log10(least))); all.empty() || all.back() < most;
         ++decade)
      for (const int digit : {1, 2, 5}) {
        const double value = digit * std::pow(10.0, decade);
        if ((digit > 1 && !few) || (!all.empty() && all.back() >= most)) continue;
        if (value <= least) all.clear();
        all.push_back(value);
      }
    return all;
  }
  double at(double value) const {
    const std::vector<double> all = lines();
    return from + (to - from) * std::log(value / all.front()) / std::log(all.back() / all.front());
  }
};

std::string text(double x, double y, std::string_view anchor, std::string_view what,
                 std::string_view more = "") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\"{}>{}</text>\n", x, y, anchor, more,
                     what);
}

std::string line(double x1, double y1, double x2, double y2) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#ddd\"/>\n", x1,
                     y1, x2, y2);
}

std::string panel(const LogPlot& plot, double offset, Axis across, Axis up) {
  across.from = offset + kLeft;
  across.to = offset + kWidth - kRight;
  up.from = kHeight - kBottom;
  up.to = kTop;
  std::string svg = text((across.from + across.to) / 2, 18, "middle", plot.title, " font-weight=\"bold\"");
  for (const double value : across.lines()) {
    const double x = across.at(value);
    svg += line(x, up.from, x, up.to) + text(x, up.from + 15, "middle", fmt::format("{:g}", value));
  }
  for (const double value : up.lines()) {
    const double y = up.at(value);
    svg +=
        line(across.from, y, across.to, y) + text(across.from - 5, y + 4, "end", fmt::format("{:g}", value));
  }
  svg += text((across.from + across.to) / 2, up.from + 33, "middle", plot.across);
  svg += text(offset + 13, (up.from + up.to) / 2, "middle", plot.up,
              fmt::format(" transform=\"rotate(-90 {:.1f} {:.1f})\"", offset + 13, (up.from + up.to) / 2));
  for (std::size_t i = 0; i < plot.curves.size(); ++i) {
    std::string points, dots;
    for (const auto& [x, y] : plot.curves[i].points) {
      points += fmt::format("{:.1f},{:.1f} ", across.at(x), up.at(y));
      dots += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.6\" fill=\"{}\"/>\n", across.at(x),
                          up.at(y), kColours[i % kColours.size()]);
    }
    svg += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"/>\n{}",
                       points, kColours[i % kColours.size()], dots);
  }
  return svg;
}

}  // namespace

std::string svgOf(std::span<const LogPlot> plots) {
  Axis across, up;
  for (const LogPlot& plot : plots)
    for (const LogPlot::Curve& curve : plot.curves)
      for (const auto& [x, y] : curve.points) {
        across.include(x);
        up.include(y);
      }
  const int width = kWidth * static_cast<int>(plots.size());
  const std::vector<LogPlot::Curve>& curves = plots.front().curves;
  const auto longest =
      std::ranges::max(curves, {}, [](const auto& curve) { return curve.name.size(); }).name.size();
  const std::size_t perRow = std::clamp<std::size_t>(
      (static_cast<std::size_t>(width) - kLeft) / (7 * longest + 24), 1, curves.size());
  const int rows = static_cast<int>((curves.size() + perRow - 1) / perRow);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      width, kHeight + kLegend + (rows - 1) * kLegendRow);
  for (std::size_t i = 0; i < plots.size(); ++i)
    svg += panel(plots[i], kWidth * static_cast<double>(i), across, up);
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const double x = kLeft + static_cast<double>(i % perRow) * (width - kLeft) / static_cast<double>(perRow);
    const double y = kHeight + 15 + static_cast<double>(i / perRow) * kLegendRow;
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{}\" width=\"12\" height=\"4\" fill=\"{}\"/>\n", x, y,
                       kColours[i % kColours.size()]) +
           text(x + 16, y + 6, "start", curves[i].name);
  }
  return svg + "</svg>\n";
}

void writeSvg(std::span<const LogPlot> plots, const std::filesystem::path& file) {
  std::ofstream out(file);
  out << svgOf(plots);
  if (!out.flush()) throw std::runtime_error(fmt::format("{} cannot be written", file.string()));
}

}  // namespace clothstream::bench
