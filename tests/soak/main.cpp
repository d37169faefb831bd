// SPDX-License-Identifier: MIT
// clothstream-soak: uses and harms a server for a long time, and measures it.
#include <cstdio>
#include <exception>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "tests/soak/soak.h"

int main(int argc, char** argv) {
  using namespace clothstream;
  // Goals of the requirements.
  constexpr double kMaxDrift = 0.01, kMinShare = 0.95, kMaxGrowth = 3;
  CLI::App app{
      "Runs a server with eight scenes. Participants come, go, vanish and read slowly; hostile clients send "
      "what they should not; scenes are created, recorded and deleted; the device is lost. Exit code 1 if "
      "the "
      "server ends or leaks descriptors, threads or scenes; with --goals also if its memory drifts by 1 % "
      "after warm-up, its descriptors or threads grow by more than 3 from the middle to the end, or honest "
      "viewers receive less than 95 % of their frames."};
  soak::SoakOptions options;
  double minutes = 10;
  bool goals = false;
  app.add_option("--server", options.server, "Program of the server")->required();
  app.add_option("--layers", options.layers, "Directory of the Vulkan layer that loses devices");
  app.add_option("--minutes", minutes, "Time of use")
      ->check(CLI::Range(0.1, 10'000.0))
      ->capture_default_str();
  app.add_option("--csv", options.csv, "File for a row a second");
  app.add_option("--participants", options.participants, "Places for participants")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--loss-seconds", options.lossSeconds, "Seconds between two losses of the device")
      ->check(CLI::Range(61.0, 100'000.0))
      ->capture_default_str();
  app.add_flag("--goals", goals, "Check memory and frames too. Use ten minutes or more, on an idle machine");
  CLI11_PARSE(app, argc, argv);
  options.seconds = 60 * minutes;
  // A sample takes a little more than a second.
  constexpr double kMinGoalMinutes = 1.2;
  if (goals && minutes < kMinGoalMinutes) {
    fmt::print(stderr, "clothstream-soak: --minutes: {} is too short for --goals; use at least {}\n", minutes,
               kMinGoalMinutes);
    return 2;
  }
  try {
    const soak::SoakReport report = soak::runSoak(options);
    if (goals && report.samples.size() < soak::SoakReport::kLeastSamples) {
      fmt::print("{}FAILED: {} samples are too few for --goals; use more --minutes\n", soak::toText(report),
                 report.samples.size());
      return 1;
    }
    fmt::print("{}", soak::toText(report));
    const bool stays = !report.crashed && !report.leaks();
    const bool grows = report.growth(&soak::Sample::descriptors) > kMaxGrowth ||
                       report.growth(&soak::Sample::threads) > kMaxGrowth;
    const bool reached = report.drift() < kMaxDrift && !grows && report.share(false) >= kMinShare;
    fmt::print("{}\n", !stays              ? "FAILED: the server ended or leaks"
                       : goals && !reached ? "FAILED: memory drifts, counts grow or frames are missing"
                                           : "ok");
    return stays && (!goals || reached) ? 0 : 1;
  } catch (const std::exception& failure) {
    fmt::print(stderr, "clothstream-soak: {}\n", failure.what());
    return 2;
  }
}
