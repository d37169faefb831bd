// SPDX-License-Identifier: MIT
// Compares frames and input, and prints the result.
#include "clients/cli/diff.h"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/compared_frames.h"
#include "clients/cli/compared_input.h"
#include "clients/cli/error.h"
#include "clients/cli/json_text.h"
#include "clients/cli/print.h"
#include "proto/codec/reach.h"
#include "proto/text/printable.h"

namespace clothstream::cli {
namespace {

using Json = nlohmann::ordered_json;
using recording::Verdict;

struct Difference {
  ComparedFrames frames;
  ComparedInput input;
  double tolerance = 0;

  // First tick whose frame or state differs.
  std::optional<std::uint64_t> firstTick() const {
    if (!frames.firstDifferent || !input.firstDifferent)
      return frames.firstDifferent ? frames.firstDifferent : input.firstDifferent;
    return std::min(*frames.firstDifferent, *input.firstDifferent);
  }
  bool isMissing() const {
    return frames.common == 0 ||
           frames.only[0] + frames.only[1] + input.onlyTicks[0] + input.onlyTicks[1] > 0 ||
           !frames.damaged[0].empty() || !frames.damaged[1].empty();
  }
  Verdict verdict() const {
    const bool differs = tolerance > 0 ? frames.largest.metres > tolerance : firstTick().has_value();
    return recording::verdictOf(differs, isMissing(), input.kernels);
  }
};

std::string lengthOf(double metres) {
  return metres < 0.1 ? fmt::format("{:.4g} mm", 1000 * metres) : fmt::format("{:.4g} m", metres);
}

std::string placeOf(const VertexDistance& place) {
  return fmt::format("{} at vertex {} of {}", lengthOf(place.metres), place.vertex, printable(place.cloth));
}

std::string textOf(const char* kind, const InputDifference& difference) {
  if (difference.text.empty()) return {};
  const std::string tick = difference.tick ? fmt::format("tick {}: ", *difference.tick) : std::string();
  return fmt::format("input     {} differ: {}{}\n", kind, tick, printable(difference.text));
}

std::string inputText(const Difference& difference) {
  const ComparedInput& input = difference.input;
  std::string text = textOf("scenes", input.scene) + textOf("ticks", input.ticks) +
                     textOf("parameters", input.parameters) + textOf("participants", input.participants);
  // The input of a tick contains its colliders.
  if (input.ticks.text.empty() && difference.frames.firstCollider)
    text += textOf("colliders", {difference.frames.firstCollider, difference.frames.collider});
  return text.empty() ? "input     equal\n" : text;
}

std::string toText(const Difference& difference, const DiffOptions& options) {
  const ComparedFrames& frames = difference.frames;
  const ComparedInput& input = difference.input;
  std::string text =
      fmt::format("A         {}, recorded on {}\nB         {}, recorded on {}\nkernels   {}\n", options.a,
                  printable(input.devices[0]), options.b, printable(input.devices[1]), nameOf(input.kernels));
  text += inputText(difference);
  text += fmt::format("frames    {} in both, {} only in A, {} only in B\n", frames.common, frames.only[0],
                      frames.only[1]);
  if (input.commonTicks + input.onlyTicks[0] + input.onlyTicks[1] > 0)
    text += fmt::format("ticks     {} in both, {} only in A, {} only in B; {} end in another state\n",
                        input.commonTicks, input.onlyTicks[0], input.onlyTicks[1], input.differentTicks);
  for (std::size_t i = 0; i < 2; ++i)
    for (const std::string& damage : frames.damaged[i])
      text += fmt::format("damaged   {}: {}\n", i == 0 ? 'A' : 'B', printable(damage));
  if (const auto first = difference.firstTick()) {
    text += fmt::format("first     tick {}", *first);
    if (frames.firstDifferent)
      text += fmt::format(
          "; first frame that differs: tick {}, {:.3f} s, {}", *frames.firstDifferent, frames.first.seconds,
          frames.first.metres > 0 ? "by at most " + placeOf(frames.first) : "only in its exact state");
    text += fmt::format("\ndistance  largest {}, tick {}; mean {}\n", placeOf(frames.largest),
                        frames.largest.tick, lengthOf(frames.mean));
    const auto precisionOf = [&](std::size_t file) {
      return lengthOf(
          codec::promisedDistance(static_cast<float>(frames.maxError[file]), frames.farthest[file]));
    };
    text += fmt::format("precision vertices of A are within {} of the simulation, of B within {}\n",
                        precisionOf(0), precisionOf(1));
  }
  const bool tolerates = difference.verdict() == Verdict::equal && difference.firstTick();
  return text + fmt::format("{}{}\n", nameOf(difference.verdict()), tolerates ? " within the tolerance" : "");
}

Json toJson(const VertexDistance& place) {
  return {{"tick", place.tick},
          {"seconds", place.seconds},
          {"cloth", place.cloth},
          {"vertex", place.vertex},
          {"metres", place.metres}};
}

void add(Json& json, const char* kind, const InputDifference& difference) {
  if (difference.text.empty()) return;
  json[kind] = {{"text", difference.text}};
  if (difference.tick) json[kind]["tick"] = *difference.tick;
}

std::string toJson(const Difference& difference, const DiffOptions& options) {
  const ComparedFrames& frames = difference.frames;
  const ComparedInput& input = difference.input;
  Json json{
      {"verdict", nameOf(difference.verdict())},
      {"exitCode", static_cast<int>(difference.verdict())},
      {"files", {options.a, options.b}},
      {"kernels", nameOf(input.kernels)},
      {"devices", input.devices},
      {"tolerance", options.tolerance},
      {"maxError", frames.maxError},
      {"input", Json::object()},
      {"frames", {{"common", frames.common}, {"only", frames.only}, {"different", frames.different}}},
      {"ticks",
       {{"common", input.commonTicks}, {"only", input.onlyTicks}, {"differentStates", input.differentTicks}}},
      {"damaged", frames.damaged},
      {"firstDifferentTick", nullptr},
      {"first", nullptr},
      {"largest", nullptr},
      {"mean", frames.mean}};
  add(json["input"], "scene", input.scene);
  add(json["input"], "ticks", input.ticks);
  add(json["input"], "parameters", input.parameters);
  add(json["input"], "participants", input.participants);
  add(json["input"], "colliders", {frames.firstCollider, frames.collider});
  if (const auto first = difference.firstTick()) json["firstDifferentTick"] = *first;
  if (frames.firstDifferent) json["first"] = toJson(frames.first);
  if (frames.largest.metres > 0) json["largest"] = toJson(frames.largest);
  return jsonText(json, 1) + '\n';
}

}  // namespace

ExitCode diff(const DiffOptions& options) {
  const std::array<std::string, 2> paths{options.a, options.b};
  auto frames = compareFrames(paths, options.limits);
  if (!frames) return printError(frames.error());
  auto input = compareInput(paths, options.limits);
  if (!input) return printError(input.error());
  for (std::size_t i = 0; i < paths.size(); ++i)
    if (input->unreadable[i] > 0)
      frames->damaged[i].push_back(
          fmt::format("{} messages of its input cannot be read", input->unreadable[i]));
  const Difference difference{std::move(*frames), std::move(*input), options.tolerance};
  put(options.json ? toJson(difference, options) : toText(difference, options));
  return exitCodeOf(difference.verdict());
}

}  // namespace clothstream::cli
