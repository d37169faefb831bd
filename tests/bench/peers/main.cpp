// SPDX-License-Identifier: MIT
// clothstream-bench-peers: ClothStream beside Debian's libraries for the same job, by turns in one run.
#include <array>
#include <cstdio>
#include <exception>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "tests/bench/peers/peers.h"
#include "tests/bench/table.h"

int main(int argc, char** argv) {
  using namespace clothstream;
  CLI::App app{"Measures ClothStream beside Debian's libraries for the same job, by turns in one run."};
  app.require_subcommand(1);
  bool json = false;
  vulkan::DeviceOptions options;
  app.add_flag("--json", json, "Print one JSON array of rows");
  app.add_option("--device", options.select, "Index or part of the name of the Vulkan device");
  CLI::App* massSpring =
      app.add_subcommand("mass_spring", "A frame of 1/60 s of a hung sheet: Bullet's soft body, and ours");
  app.add_subcommand("codec", "Frames of the curtain at 0.5 mm: Draco, meshoptimizer, and ours");
  CLI11_PARSE(app, argc, argv);
  try {
    vulkan::Device device(options);
    const bench::Rows rows = *massSpring ? bench::compareMassSpring(options) : bench::compareCodecs(device);
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
