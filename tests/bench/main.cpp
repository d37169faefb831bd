// SPDX-License-Identifier: MIT
// clothstream-bench: measures ClothStream on the Vulkan device of this machine.
#include <array>
#include <cstdio>
#include <exception>
#include <map>
#include <thread>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "tests/bench/codec/motion_options.h"
#include "tests/bench/suite.h"
#include "tests/bench/table.h"

namespace {

using namespace clothstream;

constexpr std::array kSuites{
    bench::Suite{"mass_spring", "node-steps a second for grids from 32x32 up to the device's memory",
                 &bench::runMassSpring},
    bench::Suite{"paper", "Figures 7 to 10 of the paper at its sizes, with its frames per second",
                 &bench::runPaper},
    bench::Suite{"behaviour", "Figures 11 to 15 of the paper as pictures, with checks of what they show",
                 &bench::runBehaviour},
    bench::Suite{"solvers", "a hanging sheet by every solver: cost of a substep, and strain",
                 &bench::runSolvers},
    bench::Suite{"enforcement", "constraint enforcement over all springs, by one workgroup and by several",
                 &bench::runEnforcement},
    bench::Suite{"assembled",
                 "constraints with sparse matrices as in the paper, and with the matrix-free solve",
                 &bench::runAssembled},
    bench::Suite{"equal_strain",
                 "the cheapest setting of each solver that stretches at most as much as NvCloth's",
                 &bench::runEqualStrain},
    bench::Suite{
        "coarse",
        "a sheet with a coarse correction, and with springs alone and more substeps: hanging, pushed",
        &bench::runCoarse},
    bench::Suite{"work_precision", "cost of a simulated second and distance from the truth, for every solver",
                 &bench::runWorkPrecision},
    bench::Suite{"acad", "a sheet with 0, 1, 5 and 20 % of its springs as constraints", &bench::runAcad},
    bench::Suite{"curtain", "the scene curtain, served to one client in this process: tick, pose to packet",
                 &bench::runCurtain},
    bench::Suite{"colliders", "a tick with 0, 1, 100 and 4,000 colliders, and with 100 spheres under a sheet",
                 &bench::runColliders},
    bench::Suite{"self_collision", "a sheet with and without self-collision, flat and in folds",
                 &bench::runSelfCollision},
    bench::Suite{"garment", "cloth with limits on its distance from a figure, and dressed figures that walk",
                 &bench::runGarment},
    bench::Suite{"codec", "the codec on the CPU over motions: bits, errors, flicker, times",
                 &bench::runCodec},
    bench::Suite{"codec_device", "cost of key and predicted frames of a hung cloth on the device",
                 &bench::runCodecDevice},
    bench::Suite{"price", "the computed price of a tick, and the measured tick, for every solver",
                 &bench::runPrice},
    bench::Suite{"batch", "a tick of 1 to 1,000 equal scenes in one submission: time, commands, allocations",
                 &bench::runBatch},
    bench::Suite{"creation", "time to check, prepare, load and delete a scene, for each of its nodes",
                 &bench::runCreation},
    bench::Suite{"doctor",
                 "what clothstream-server doctor --accept finds about the device, and the machine's name",
                 &bench::runDoctor},
    bench::Suite{"kernels",
                 "registers, spills, instructions, bytes and bounds of every kernel; it only compiles them",
                 &bench::runKernels, true},
};

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Measures ClothStream on the Vulkan device of this machine."};
  std::map<std::string, const bench::Suite*> suites;
  std::string list;
  for (const bench::Suite& suite : kSuites) {
    suites[suite.name] = &suite;
    list += fmt::format("\n  {}: {}", suite.name, suite.description);
  }
  std::string name;
  bench::Settings settings;
  bool json = false;
  std::uint32_t size = 0, softwareThreads = 0, xpbdWholeNodes = 0, solveWholeNodes = 0;
  app.add_option("suite", name, "Suite to run:" + list)->required()->check(CLI::IsMember(suites));
  CLI::Option* sizeOption =
      app.add_option("--size", size, "Rows and columns of the grid (default: the suite's sizes)")
          ->check(CLI::Range(2, 65536));
  app.add_flag("--json", json, "Print the rows as one JSON array, each when it is measured");
  app.add_option("--device", settings.device.select, "Index or part of the name of the Vulkan device");
  CLI::Option* threadsOption = app.add_option("--software-threads", softwareThreads,
                                              "Threads of a software device (0: only the calling thread)");
  const std::map<std::string, vulkan::KernelSettings> kernels{{"auto", vulkan::KernelSettings::automatic},
                                                              {"cpu", vulkan::KernelSettings::cpu},
                                                              {"gpu", vulkan::KernelSettings::gpu}};
  app.add_option("--kernels", settings.device.kernels, "Settings of the kernels: auto, cpu or gpu")
      ->transform(CLI::CheckedTransformer(kernels));
  app.add_option("--seconds", settings.seconds, "Seconds to measure for each row")
      ->check(CLI::PositiveNumber);
  app.add_option("--rows", settings.rowsPerInvocation, "Rows of a grid for each invocation (0: automatic)");
  app.add_option("--workgroup", settings.workgroupSize, "Invocations of a workgroup (0: automatic)");
  app.add_option("--scene", settings.scenes, "Scene of suite doctor; may be repeated (default: all)");
  app.add_option("--crowd", settings.crowds, "Number of scenes of suite batch; may be repeated")
      ->check(CLI::Range(1, 10'000))
      ->capture_default_str();
  app.add_option("--pictures", settings.pictures, "Directory of the pictures")
      ->check(CLI::ExistingDirectory)
      ->capture_default_str();
  CLI::Option* wholeOption = app.add_option("--xpbd-whole", xpbdWholeNodes,
                                            "Maximum nodes of a cloth that one workgroup sweeps (xpbd)");
  CLI::Option* solveOption =
      app.add_option("--solve-whole", solveWholeNodes, "Maximum nodes of a cloth that one workgroup solves");
  bench::addMotionOptions(app, settings);
  CLI11_PARSE(app, argc, argv);
  if (*sizeOption) settings.size = size;
  if (*wholeOption) settings.xpbdWholeNodes = xpbdWholeNodes;
  if (*solveOption) settings.solveWholeNodes = solveWholeNodes;
  if (*threadsOption) settings.device.softwareThreads = softwareThreads;

  try {
    settings.device.compileOnly = suites.at(name)->compileOnly;
    vulkan::Device device(settings.device);
    if (!json)
      fmt::print("{}, {}, Vulkan {}, {} CPU threads\n", device.info().name, device.info().driver,
                 device.info().apiVersion, std::thread::hardware_concurrency());
    bench::Rows rows;
    suites.at(name)->run(device, settings, [&](const bench::Row& row) {
      if (json) {
        fmt::print("{}\n  {}", rows.empty() ? "[" : ",", row.dump());
        std::fflush(stdout);
      }
      rows.push_back(row);
    });
    if (json)
      fmt::print("{}\n]\n", rows.empty() ? "[" : "");
    else
      bench::printTable(rows);
  } catch (const std::exception& error) {
    fmt::print(stderr, "clothstream-bench: {}: {}\n", name, error.what());
    return 1;
  }
  return 0;
}
