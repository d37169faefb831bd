// SPDX-License-Identifier: MIT
// Reads the command line.
#include "server/program_options.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "server/hosting/scene_server.h"

namespace clothstream {
namespace {

std::filesystem::path defaultCacheDirectory() {
  if (const char* cache = std::getenv("XDG_CACHE_HOME"); cache != nullptr && *cache != '\0')
    return std::filesystem::path(cache) / "clothstream";
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0')
    return std::filesystem::path(home) / ".cache" / "clothstream";
  return {};
}

constexpr const char* kDevice = "Device";

void addDeviceOptions(CLI::App& app, ProgramOptions& options) {
  app.add_option("--device", options.device, "Index or part of the name of a Vulkan device; else the best")
      ->group(kDevice);
  app.add_option("--software-threads", options.softwareThreads,
                 "Threads of a software device beside the one that waits; else what suits --scene")
      ->check(CLI::Range(0, 64))
      ->group(kDevice);
  app.add_option("--cache-dir", options.cacheDirectory, "Where compiled kernels are kept; '' for nowhere")
      ->type_name("DIR")
      ->capture_default_str()
      ->group(kDevice);
}

void addStepOptions(CLI::App& app, ProgramOptions& options, step::StepOptions& stepOptions) {
  app.footer(
      "The file holds frames of little-endian float32, six a node: position and velocity. FILE.json says how "
      "many of "
      "what,\n"
      "and how the simulation did. In Python: numpy.fromfile(FILE, '<f4').reshape(json.load(open(FILE + "
      "'.json'))['shape'])\n"
      "Ends with 0 if all ticks were run, 1 for an error or a state that left the range of numbers, 130 if "
      "interrupted.");
  app.add_option("--scene", options.scene, "Name of a scene, or a JSON file")->required();
  app.add_option("--ticks", stepOptions.ticks, "How many")
      ->required()
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000}));
  app.add_option("--out", stepOptions.out, "The file that is written; FILE.json stands beside it")
      ->type_name("FILE")
      ->required();
  app.add_option("--every", stepOptions.every, "Write a state every so many ticks; the start is the first")
      ->check(CLI::Range(std::uint64_t{1}, std::uint64_t{1'000'000'000}))
      ->capture_default_str();
  app.add_option("--rate", options.rate, "Ticks a second, instead of the scene's own")
      ->check(CLI::Range(1, 1000));
  app.add_option("--substeps", options.substeps, "Integration steps a tick, instead of the scene's own")
      ->check(CLI::Range(1, 256));
  addDeviceOptions(app, options);
}

}  // namespace

std::variant<ProgramOptions, int> parseOptions(int argc, const char* const* argv) {
  ProgramOptions options;
  options.cacheDirectory = defaultCacheDirectory();
  double seconds = 0, hold = 60;
  std::vector<std::string> changeable;
  const std::map<std::string, model::Normals> normals{{"none", model::Normals::none},
                                                      {"octahedral", model::Normals::octahedral}};
  const std::map<std::string, model::Coding> codings{{"entropy", model::Coding::entropy},
                                                     {"packed", model::Coding::packed}};

  CLI::App app{"Simulates cloth with Vulkan and streams it to browsers and gRPC clients.",
               "clothstream-server"};
  app.set_version_flag("--version", "clothstream-server " CLOTHSTREAM_VERSION);
  app.get_formatter()->column_width(34);
  app.option_defaults()->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);  // scripts append to defaults

  const char* scenes = "Scenes";
  app.add_option("--scene", options.scene, "Scene for whoever names none")
      ->capture_default_str()
      ->group(scenes);
  app.add_option("--scene-file", options.sceneFiles, "Another scene, as a JSON file; may be given again")
      ->type_name("FILE")
      ->group(scenes);
  app.add_option("--rate", options.rate, "Ticks a second of --scene, instead of its own")
      ->check(CLI::Range(1, 1000))
      ->group(scenes);
  app.add_option("--substeps", options.substeps, "Integration steps a tick of --scene")
      ->check(CLI::Range(1, 256))
      ->group(scenes);
  app.add_option("--max-error", options.maxError, "Largest error of a streamed coordinate of --scene, metres")
      ->group(scenes);
  app.add_option("--normals", options.normals,
                 "Normals of --scene: none (clients compute them) or octahedral")
      ->transform(CLI::CheckedTransformer(normals, CLI::ignore_case))
      ->group(scenes);
  app.add_option("--coding", options.coding,
                 "How residuals of --scene are written: entropy (fewest bits) or packed (by the device)")
      ->transform(CLI::CheckedTransformer(codings, CLI::ignore_case))
      ->group(scenes);
  app.add_option("--temporal-layers", options.temporalLayers,
                 "Temporal layers of --scene: those above the first are left out for clients with slow links")
      ->check(CLI::Range(1, 3))
      ->group(scenes);
  app.add_option("--qualities", options.qualities,
                 "Qualities in which --scene can come: the coarser ones are for clients with slow links")
      ->check(CLI::Range(1, 4))
      ->group(scenes);
  app.add_flag("--always-run", options.alwaysRun,
               "Go on simulating while nobody is there: --scene from the start, others once somebody came")
      ->group(scenes);
  app.add_option("--reports", options.reportRate,
                 "Frames a second that tell how the simulation does: strain, energy, ...; 0: none")
      ->check(CLI::Range(0.0, 1000.0))
      ->capture_default_str()
      ->group(scenes);

  CLI::Option* record =
      app.add_option("--record", options.recordDirectory,
                     "Record every scene while it runs, each to a file of its own in this directory")
          ->type_name("DIR")
          ->group(scenes);
  const CLI::Option* recordings =
      app.add_option("--recordings", options.recordDirectory,
                     "Record the scenes that clients ask to be recorded, to files in this directory")
          ->type_name("DIR")
          ->excludes(record)
          ->group(scenes);
  app.add_option("--record-limit", options.recordLimitMb,
                 "Go on in another file when one has so many megabytes; 0: never")
      ->check(CLI::Range(0.0, 1e9))
      ->capture_default_str()
      ->group(scenes);
  app.add_option("--max-created-scenes", options.maxCreatedScenes,
                 "Scenes that clients may create beside these; 0: none")
      ->check(CLI::Range(0, 1000))
      ->capture_default_str()
      ->group(scenes);
  app.add_option("--encoder-threads", options.encoderThreads,
                 "Threads that predict large frames where the device does not; 0: a quarter of the "
                 "processors, 8 at most")
      ->check(CLI::Range(0, 64))
      ->capture_default_str()
      ->group(scenes);
  const char* people = "People";
  app.add_option("--hold", hold,
                 "Seconds for which the place of somebody whose connection is lost is kept; 0: not at all")
      ->check(CLI::Range(0.0, 3600.0))
      ->capture_default_str()
      ->group(people);
  app.add_option("--max-participants", options.maxParticipants,
                 "People in a scene; who is cut off makes room for somebody who comes where it is full")
      ->check(CLI::Range(1u, hosting::kMostParticipants))
      ->capture_default_str()
      ->group(people);
  app.add_option("--participants-change", changeable,
                 "Parameters that participants change of a scene that somebody else owns: a list of "
                 "environment, cloths and colliders, or none")
      ->delimiter(',')
      ->type_name("LIST")
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->check(CLI::IsMember({"environment", "cloths", "colliders", "none"}))
      ->default_str("environment,cloths,colliders")
      ->group(people);
  app.add_flag(
         "--owners-alone", options.ownersAlone,
         "A scene that somebody owns is paused, reset and deleted by its owners alone, not from outside")
      ->group(people);
  app.add_flag("--list-materials", options.listMaterials, "Show what cloths may be made of, and exit")
      ->group(scenes);

  const char* network = "Network";
  app.add_option("--host", options.host, "Address to listen on; 0.0.0.0 for every one this machine has")
      ->capture_default_str()
      ->group(network);
  app.add_option("--port", options.port, "Port of the page and the WebSocket; 0 for one that is free")
      ->capture_default_str()
      ->group(network);
  app.add_option("--grpc-port", options.grpcPort, "Port of gRPC; 0 for one that is free")
      ->capture_default_str()
      ->group(network);
  app.add_option("--page", options.page, "Directory of the page, instead of the one beside the program")
      ->type_name("DIR")
      ->group(network);
  app.add_option("--allow-origin", options.allowedOrigins,
                 "A page from elsewhere that may connect, such as https://example.org; may be given again")
      ->type_name("ORIGIN")
      ->group(network);

  addDeviceOptions(app, options);
  app.add_flag("--list-devices", options.listDevices, "Show the Vulkan devices there are, and exit")
      ->group(kDevice);

  CLI::App& printCommand = *app.add_subcommand(
      "print-scene", "Print a scene as JSON with every default, and its meshes' geometry, filled in");
  printCommand.add_option("SCENE", options.printScene, "Name of a scene, or a JSON file")->required();

  step::StepOptions stepOptions;
  CLI::App& stepCommand =
      *app.add_subcommand("step", "Run a scene without clock or network, and write its states to a file");
  addStepOptions(stepCommand, options, stepOptions);

  CLI::App& resimulateCommand = *app.add_subcommand(
      "resimulate", "Simulate a recording's ticks once more, and compare each state with what it was");
  resimulateCommand.add_option("FILE", options.resimulate, "What --record wrote")->required();
  resimulateCommand.footer(
      "Ends with 0 if every state is the same to the bit, 1 for an error, a difference or a part that is "
      "missing, "
      "130 if interrupted.");
  addDeviceOptions(resimulateCommand, options);

  CLI::App& playCommand = *app.add_subcommand(
      "play", "Serve a recording as a scene: clients join it, and pause, seek, speed, loop it");
  playCommand.add_option("FILE", options.play, "What --record or `clothstream record` wrote")->required();
  playCommand.add_option("--from", options.playback.from, "Begin so many seconds after its start")
      ->check(CLI::NonNegativeNumber);
  playCommand.add_option("--speed", options.playback.speed, "Seconds of it that pass in one")
      ->check(CLI::Range(recording::kMinSpeed, recording::kMaxSpeed))
      ->capture_default_str();
  playCommand.add_flag("--loop", options.playback.loop,
                       "Go on from its start at its end, instead of pausing there");
  playCommand.footer(
      "Options of people, the network and the log are those of clothstream-server. No device is needed.");
  playCommand.fallthrough();

  app.add_option("--log-level", options.logLevel, "trace, debug, info, warning, error or off")
      ->capture_default_str();
  const CLI::Option* stopAfter =
      app.add_option("--seconds", seconds, "Stop after so long")->check(CLI::PositiveNumber);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 1;
  }
  options.recordsOnRequest = recordings->count() > 0;
  options.hold = std::chrono::duration<double>(hold);
  if (!changeable.empty()) {
    const auto given = [&](const char* what) {
      return std::ranges::find(changeable, what) != changeable.end();
    };
    if (given("none") && changeable.size() > 1) {
      fmt::print(stderr, "--participants-change: none stands alone\n");
      return 1;
    }
    options.participantsMay = {given("environment"), given("cloths"), given("colliders")};
  }
  if (stepCommand.parsed()) options.step = stepOptions;
  if (stopAfter->count() > 0) options.stopAfter = std::chrono::duration<double>(seconds);
  return options;
}

}  // namespace clothstream
