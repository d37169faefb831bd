// SPDX-License-Identifier: MIT
// Options of clothstream-server: from the command line, the environment and an option file.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/model/scene.h"
#include "server/recording/playback.h"
#include "server/scene/roles.h"
#include "server/step/step.h"

namespace clothstream {

enum class Command { serve, play, resimulate, step, printScene, listDevices, listMaterials };

struct ProgramOptions {
  Command command = Command::serve;

  // Scenes.
  std::string scene = "curtain";  // default scene of the server; the scene of `step`
  std::vector<std::filesystem::path> sceneFiles;
  // Overrides for the scene above; unset keeps the scene's own value.
  std::optional<std::uint32_t> rate, substeps;
  std::optional<float> maxError;
  std::optional<model::Normals> normals;
  std::optional<model::Coding> coding;
  std::optional<std::uint32_t> temporalLayers, qualities;
  bool alwaysRun = false;
  double reportRate = 4;  // reports per second, 0 to 1000
  std::uint32_t maxCreatedScenes = 16;
  std::uint32_t encoderThreads = 0;       // 0 means automatic
  std::filesystem::path recordDirectory;  // empty: nothing is recorded
  bool recordsOnRequest = false;          // record only scenes that clients ask for
  double recordLimitMb = 0;               // megabytes per file; 0 means no limit

  // Participants.
  std::chrono::duration<double> hold{60};  // reconnect grace
  std::uint32_t maxParticipants = 64;
  scene::Permissions participantsMay;  // what a participant may change in a scene that another one owns
  bool ownersAlone = false;            // only an owner controls a scene that has one

  // Network.
  std::string host = "127.0.0.1";
  std::uint16_t port = 8080, grpcPort = 50051;
  std::filesystem::path page;  // empty: the directory next to the program, if it exists
  std::vector<std::string> allowedOrigins;

  // Device.
  std::string device;  // index or part of a name; empty: the best
  std::optional<std::uint32_t> softwareThreads;
  std::filesystem::path cacheDirectory;  // empty: no cache

  // Program.
  std::string logLevel = "info";
  std::optional<std::chrono::duration<double>> stopAfter;
  std::vector<std::string> warnings;  // about environment variables, for the log

  // Commands.
  step::StepOptions step;
  recording::PlaybackOptions playback;
  std::string recording;   // file of `play` and `resimulate`
  std::string printScene;  // name or file
};

// Returns the options, or the exit code if the program must end: after --help, --version, --print-config or a
// wrong option. The output or the error has then been printed.
std::variant<ProgramOptions, int> parseOptions(int argc, const char* const* argv);

}  // namespace clothstream
