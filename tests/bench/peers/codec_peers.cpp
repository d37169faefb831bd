// SPDX-License-Identifier: MIT
// Our codecs compared with raw floats, Draco, meshoptimizer and zstd. They alternate frame by frame.
#include <array>
#include <optional>
#include <stdexcept>

#include "tests/bench/codec/bench_motion.h"
#include "tests/bench/codec/codec_measurement.h"
#include "tests/bench/codec/our_codec.h"
#include "tests/bench/peers/peer_codecs.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/picture/log_plot.h"
#include "tests/bench/picture/rasterise.h"

namespace clothstream::bench {
namespace {

// Max errors of the curves.
constexpr std::array kErrors{0.0001, 0.0002, 0.0005, 0.001, 0.002};

// Our codecs, then the others, all at this max error.
std::vector<CodecMeasurement> measurements(const codec::ClothLayout& cloth, double maxError) {
  std::vector<CodecMeasurement> all;
  all.emplace_back(std::make_unique<OurCodec>(codec::StreamLayout{
                       .epoch = 1, .maxError = static_cast<float>(maxError), .cloths = {cloth}}),
                   cloth, maxError);
  for (std::unique_ptr<FrameCodec>& peer : peerCodecs(cloth, maxError))
    all.emplace_back(std::move(peer), cloth, maxError);
  return all;
}

void play(const BenchMotion& motion, std::vector<CodecMeasurement>& all) {
  Truth truth(motion.cloth);
  motion.play([&](std::span<const float> positions) {
    const TrueFrame frame = truth.next(positions);
    for (CodecMeasurement& one : all) one.add(frame);
  });
}

struct Figure {
  const char *file, *up, *field;
};
constexpr std::array kFigures{
    Figure{"codec_distance", "largest distance, mm", "measuredMaxErrorMm"},
    Figure{"codec_normals", "error of normals, mean, degrees", "normalErrorDegMean"},
    Figure{"codec_flicker", "flicker of normals, RMS, degrees", "normalFlickerDegRms"}};

LogPlot plotOf(const std::string& motion, const Rows& rows, const Figure& figure) {
  LogPlot plot{motion, "bits a vertex a frame", figure.up, {}};
  for (const auto& row : rows) {
    if (row.at("motion") != motion) continue;
    const auto name = row.at("codec").get<std::string>();
    auto curve = std::ranges::find(plot.curves, name, &LogPlot::Curve::name);
    if (curve == plot.curves.end()) curve = plot.curves.insert(curve, LogPlot::Curve{name, {}});
    curve->points.emplace_back(row.at("bitsPerVertex").get<double>(), row.at(figure.field).get<double>());
  }
  return plot;
}

}  // namespace

Rows compareCodecs(vulkan::Device& device, const Settings& settings) {
  Rows rows;
  for (const BenchMotion& motion : chosenMotions(device, settings)) {
    std::vector<CodecMeasurement> all = measurements(motion.cloth, double{settings.maxError});
    all.emplace_back(rawFloats(), motion.cloth, 0);
    play(motion, all);
    for (const CodecMeasurement& one : all) rows.push_back(one.row(motion.name));
  }
  return rows;
}

Rows codecCurves(vulkan::Device& device, const Settings& settings) {
  Rows rows;
  std::vector<std::string> names;
  for (const BenchMotion& motion : chosenMotions(device, settings)) {
    std::vector<CodecMeasurement> all;
    for (const double maxError : kErrors)
      for (CodecMeasurement& one : measurements(motion.cloth, maxError)) all.push_back(std::move(one));
    play(motion, all);
    for (const CodecMeasurement& one : all) rows.push_back(one.row(motion.name));
    names.push_back(motion.name);
  }
  for (const Figure& figure : kFigures) {
    std::vector<LogPlot> plots;
    for (const std::string& name : names) plots.push_back(plotOf(name, rows, figure));
    writePng(svgOf(plots), settings.pictures / (std::string(figure.file) + ".png"));
  }
  return rows;
}

}  // namespace clothstream::bench
