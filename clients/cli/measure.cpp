// SPDX-License-Identifier: MIT
// Prints the measures of a file as a table, JSON or CSV.
#include "clients/cli/measure.h"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/cloth_measures.h"
#include "clients/cli/error.h"
#include "clients/cli/json_text.h"
#include "clients/cli/print.h"
#include "proto/codec/reach.h"

namespace clothstream::cli {
namespace {

using Json = nlohmann::ordered_json;

// Default of cloths without a material (scene.proto).
constexpr double kDefaultArealMass = 0.2;
constexpr measure::Point kDefaultGravity{0, -9.81, 0};

// One quantity of a cloth, with its name in tables and in JSON.
struct Quantity {
  const char* name;
  const char* key;
  std::optional<double> (*of)(const ClothMeasures&);
};
constexpr std::array<Quantity, 7> kQuantities{{
    {"strain, mean", "strainMean",
     [](const ClothMeasures& m) -> std::optional<double> { return m.strain.mean; }},
    {"strain, 99 %", "strainP99",
     [](const ClothMeasures& m) -> std::optional<double> { return m.strain.p99; }},
    {"strain, largest", "strainMax",
     [](const ClothMeasures& m) -> std::optional<double> { return m.strain.largest; }},
    {"penetration, m", "penetration",
     [](const ClothMeasures& m) -> std::optional<double> { return m.penetration; }},
    {"intersections", "intersections",
     [](const ClothMeasures& m) -> std::optional<double> { return static_cast<double>(m.intersections); }},
    {"kinetic energy, J", "kineticEnergy", [](const ClothMeasures& m) { return m.kinetic; }},
    {"gravity energy, J", "gravityEnergy",
     [](const ClothMeasures& m) -> std::optional<double> { return m.gravity; }},
}};

// Figures of one quantity over all frames.
struct Summary {
  double first = 0, last = 0, sum = 0, largest = 0;
  std::uint64_t count = 0, tick = 0;  // tick of the largest value

  void add(double value, std::uint64_t at) {
    if (count++ == 0) first = value;
    last = value;
    sum += value;
    if (count > 1 && value <= largest) return;
    largest = value;
    tick = at;
  }
  double mean() const { return count > 0 ? sum / static_cast<double>(count) : 0; }
};

// Takes the measures of each frame and prints them in one of the formats.
class Output {
 public:
  Output(const Motion& motion, const MeasureOptions& options, const MeasureSettings& settings)
      : motion_(motion), options_(options), settings_(settings), summaries_(motion.surface().cloths.size()) {
    if (options.format != MeasureFormat::csv) return;
    print("tick,seconds,cloth");
    for (const Quantity& quantity : kQuantities) print(",{}", quantity.key);
    print("\n");
  }

  void take(const FrameMeasures& frame) {
    ++frames_;
    farthest_ = std::max(farthest_, frame.farthest);
    for (std::size_t i = 0; i < frame.cloths.size(); ++i)
      for (std::size_t k = 0; k < kQuantities.size(); ++k)
        if (const auto value = kQuantities[k].of(frame.cloths[i])) summaries_[i][k].add(*value, frame.tick);
    if (options_.format == MeasureFormat::csv) printRows(frame);
    if (options_.format == MeasureFormat::json) json_["frames"].push_back(toJson(frame));
  }

  void finish() {
    if (options_.format == MeasureFormat::text) printTable();
    if (options_.format == MeasureFormat::json) printJson();
  }

 private:
  const measure::Cloth& cloth(std::size_t i) const { return motion_.surface().cloths[i]; }

  void printRows(const FrameMeasures& frame) const {
    for (std::size_t i = 0; i < frame.cloths.size(); ++i) {
      print("{},{:.6f},{}", frame.tick, frame.seconds, csvName(cloth(i).name));
      for (const Quantity& quantity : kQuantities) {
        const auto value = quantity.of(frame.cloths[i]);
        print(",{}", value ? fmt::format("{:.9g}", *value) : "");
      }
      print("\n");
    }
  }

  // Names of files from elsewhere may have any character; print() escapes those of a terminal.
  static std::string csvName(const std::string& name) {
    std::string quoted = name;
    if (quoted.find_first_of(",\"") == quoted.npos) return quoted;
    for (std::size_t at = quoted.find('"'); at != quoted.npos; at = quoted.find('"', at + 2))
      quoted.insert(at, 1, '"');
    return '"' + quoted + '"';
  }

  static Json toJson(const FrameMeasures& frame) {
    Json cloths = Json::array();
    for (const ClothMeasures& measures : frame.cloths) {
      Json& entry = cloths.emplace_back();
      for (const Quantity& quantity : kQuantities) {
        const auto value = quantity.of(measures);
        entry[quantity.key] = value ? Json(*value) : Json(nullptr);
      }
    }
    return {{"tick", frame.tick}, {"seconds", frame.seconds}, {"cloths", std::move(cloths)}};
  }

  void printTable() const {
    print("{}: {} frames, {} ticks/s; coordinates {}\n", options_.file, frames_, motion_.rate(),
          motion_.maxError() > 0
              ? fmt::format("within {:.3g} m of the simulation",
                            codec::promisedDistance(static_cast<float>(motion_.maxError()), farthest_))
              : "as in the file");
    for (std::size_t i = 0; i < summaries_.size(); ++i) {
      print("\n{}, {} vertices, {:.4g} kg/m^2\n{:<20}{:>12}{:>12}{:>12}{:>12}{:>10}\n", cloth(i).name,
            cloth(i).vertexCount, settings_.arealMass[i], "", "first", "last", "mean", "largest", "at tick");
      for (std::size_t k = 0; k < kQuantities.size(); ++k) {
        const Summary& summary = summaries_[i][k];
        if (summary.count == 0) continue;
        print("{:<20}{:>12.5g}{:>12.5g}{:>12.5g}{:>12.5g}{:>10}\n", kQuantities[k].name, summary.first,
              summary.last, summary.mean(), summary.largest, summary.tick);
      }
    }
  }

  void printJson() {
    Json cloths = Json::array();
    for (std::size_t i = 0; i < summaries_.size(); ++i) {
      Json& entry = cloths.emplace_back(Json{{"name", cloth(i).name},
                                             {"vertices", cloth(i).vertexCount},
                                             {"arealMass", settings_.arealMass[i]}});
      for (std::size_t k = 0; k < kQuantities.size(); ++k) {
        const Summary& summary = summaries_[i][k];
        if (summary.count == 0) continue;
        entry[kQuantities[k].key] = {{"first", summary.first},
                                     {"last", summary.last},
                                     {"mean", summary.mean()},
                                     {"largest", summary.largest},
                                     {"tick", summary.tick}};
      }
    }
    Json whole{{"file", options_.file},
               {"rate", motion_.rate()},
               {"maxError", motion_.maxError()},
               {"gravity", settings_.gravity},
               {"cloths", std::move(cloths)}};
    whole.update(json_);
    put(jsonText(whole, 1) + '\n');
  }

  const Motion& motion_;
  const MeasureOptions& options_;
  const MeasureSettings& settings_;
  std::vector<std::array<Summary, kQuantities.size()>> summaries_;  // by cloth
  std::uint64_t frames_ = 0;
  float farthest_ = 0;  // largest magnitude of a coordinate so far, metres
  Json json_{{"frames", Json::array()}};
};

MeasureSettings settingsOf(const Motion& motion, const MeasureOptions& options) {
  MeasureSettings settings;
  settings.gravity = options.gravity.value_or(motion.gravity().value_or(kDefaultGravity));
  settings.intersections = options.intersections;
  const measure::Surface& surface = motion.surface();
  for (std::size_t i = 0; i < surface.cloths.size(); ++i) {
    const double area = measure::areaOf(surface, surface.cloths[i]);
    const auto mass = motion.massOf(i);
    const double recorded = mass && area > 0 ? *mass / area : kDefaultArealMass;
    settings.arealMass.push_back(options.arealMass.value_or(recorded));
  }
  return settings;
}

}  // namespace

ExitCode measureFile(const MeasureOptions& options) {
  auto motion = openMotion(options.file, options.arrays, options.limits);
  if (!motion) return printError(motion.error());
  const MeasureSettings settings = settingsOf(**motion, options);
  Output output(**motion, options, settings);
  const auto measured =
      measureFrames(**motion, settings, [&](const FrameMeasures& frame) { output.take(frame); });
  if (!measured) return printError(measured.error());
  output.finish();
  return kOk;
}

}  // namespace clothstream::cli
