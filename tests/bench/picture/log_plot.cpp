// SPDX-License-Identifier: MIT
// Curves over two logarithmic axes, as an SVG file.
#include "tests/bench/picture/log_plot.h"

#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <stdexcept>

#include <fmt/format.h>

namespace clothstream::bench {
namespace {

constexpr int kWidth = 330, kHeight = 300, kLeft = 52, kBottom = 44, kTop = 28, kRight = 12, kLegend = 44;
constexpr std::array kColours{"#1b6ca8", "#3aa6d0", "#7a4fa3", "#d1495b", "#2e8b57", "#c98a1b", "#666666"};

// Whole decades about all values, and where a value lies between pixels.
struct Axis {
  int low = std::numeric_limits<int>::max(), high = std::numeric_limits<int>::min();
  double from = 0, to = 0;

  void include(double value) {
    low = std::min(low, static_cast<int>(std::floor(std::log10(value))));
    high = std::max(high, static_cast<int>(std::ceil(std::log10(value))));
  }
  double at(double value) const { return from + (to - from) * (std::log10(value) - low) / (high - low); }
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
  for (int decade = across.low; decade <= across.high; ++decade) {
    const double x = across.at(std::pow(10.0, decade));
    svg += line(x, up.from, x, up.to) +
           text(x, up.from + 15, "middle", fmt::format("{:g}", std::pow(10.0, decade)));
  }
  for (int decade = up.low; decade <= up.high; ++decade) {
    const double y = up.at(std::pow(10.0, decade));
    svg += line(across.from, y, across.to, y) +
           text(across.from - 5, y + 4, "end", fmt::format("{:g}", std::pow(10.0, decade)));
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

void writeSvg(std::span<const LogPlot> plots, const std::filesystem::path& file) {
  Axis across, up;
  for (const LogPlot& plot : plots)
    for (const LogPlot::Curve& curve : plot.curves)
      for (const auto& [x, y] : curve.points) {
        across.include(x);
        up.include(y);
      }
  const int width = kWidth * static_cast<int>(plots.size());
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" font-size=\"11\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      width, kHeight + kLegend);
  for (std::size_t i = 0; i < plots.size(); ++i)
    svg += panel(plots[i], kWidth * static_cast<double>(i), across, up);
  const std::vector<LogPlot::Curve>& curves = plots.front().curves;
  for (std::size_t i = 0; i < curves.size(); ++i) {
    const double x = kLeft + static_cast<double>(i) * (width - kLeft) / static_cast<double>(curves.size());
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{}\" width=\"12\" height=\"4\" fill=\"{}\"/>\n", x,
                       kHeight + 15, kColours[i % kColours.size()]) +
           text(x + 16, kHeight + 21, "start", curves[i].name);
  }
  std::ofstream out(file);
  out << svg << "</svg>\n";
  if (!out.flush()) throw std::runtime_error(fmt::format("{} cannot be written", file.string()));
}

}  // namespace clothstream::bench
