// SPDX-License-Identifier: MIT
// clothstream-bench-peers: ClothStream compared with Debian's libraries for the same job, alternating in one
// run.
#include <array>
#include <cstdio>
#include <exception>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "tests/bench/codec/motion_options.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/table.h"

int main(int argc, char** argv) {
  using namespace clothstream;
  CLI::App app{"Compares ClothStream with Debian's libraries for the same job, alternating in one run."};
  app.require_subcommand(1);
  bool json = false;
  vulkan::DeviceOptions options;
  app.add_flag("--json", json, "Print the rows as one JSON array");
  app.add_option("--device", options.select, "Index or part of the name of the Vulkan device");
  CLI::App* massSpring =
      app.add_subcommand("mass_spring", "A frame of 1/60 s of a hung sheet: Bullet's soft body, and ours");
  bench::Settings settings;
  std::uint32_t size = 0;
  CLI::App* nothingPasses = app.add_subcommand(
      "nothing_passes",
      "Stress scenes: balls, cloth that nothing passes through, and Bullet's deformable cloth");
  int ticks = 1000;
  nothingPasses->add_option("--ticks", ticks, "Ticks of each scene (default: all)")
      ->check(CLI::Range(1, 1000));
  CLI::App* codec =
      app.add_subcommand("codec", "Motions by raw floats, Draco, meshoptimizer, zstd, and ours");
  CLI::App* curves = app.add_subcommand("codec_curves", "Bits against errors of the same");
  for (CLI::App* one : {codec, curves}) {
    bench::addMotionOptions(*one, settings);
    one->add_option("--size", size, "Rows and columns of the grid (default: 100)")
        ->check(CLI::Range(2, 4096));
    one->add_flag("--json", json, "Print the rows as one JSON array");
  }
  CLI11_PARSE(app, argc, argv);
  if (size > 0) settings.size = size;
  try {
    vulkan::Device device(options);
    const bench::Rows rows = *massSpring      ? bench::compareMassSpring(options)
                             : *nothingPasses ? bench::compareNothingPasses(options, ticks)
                             : *codec         ? bench::compareCodecs(device, settings)
                                              : bench::codecCurves(device, settings);
    if (json)
      fmt::print("{}\n", nlohmann::ordered_json(rows).dump(2));
    else
      bench::printTable(rows);
  } catch (const std::exception& error) {
    fmt::print(stderr, "clothstream-bench-peers: {}\n", error.what());
    return 1;
  }
  return 0;
}
