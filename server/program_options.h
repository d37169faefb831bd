// SPDX-License-Identifier: MIT
// What clothstream-server is told on its command line.
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
#include "server/step/step.h"
#include "server/scene/roles.h"

namespace clothstream {

struct ProgramOptions {
  std::string scene = "curtain";
  std::vector<std::filesystem::path> sceneFiles;
  // Of the scene above, instead of its own.
  std::optional<std::uint32_t> rate, substeps;
  std::optional<float> maxError;
  std::optional<model::Normals> normals;
  std::optional<model::Coding> coding;
  std::optional<std::uint32_t> temporalLayers, qualities;
  bool alwaysRun = false;
  double reportRate = 4;
  std::uint32_t maxCreatedScenes = 16;
  std::uint32_t encoderThreads = 0;
  std::chrono::duration<double> hold{60};  // of who is cut off
  // What participants change of a scene that somebody else owns, and whether it is controlled from outside.
  std::uint32_t maxParticipants = 64;
  scene::Permissions participantsMay;
  bool ownersAlone = false;
  std::optional<step::StepOptions> step;  // instead of serving
  std::string resimulate;                 // a recording, instead of serving; empty: none
  std::string play;                       // a recording, instead of scenes; empty: none
  recording::PlaybackOptions playback;    // of it
  std::filesystem::path recordDirectory;  // empty: nothing is recorded
  bool recordsOnRequest = false;          // and only then
  double recordLimitMb = 0;               // of a file; 0: none

  std::string host = "127.0.0.1";
  std::uint16_t port = 8080, grpcPort = 50051;
  std::filesystem::path page;  // empty: beside the program, if it is there
  std::vector<std::string> allowedOrigins;

  std::string device;
  std::optional<std::uint32_t> softwareThreads;
  std::filesystem::path cacheDirectory;  // empty: none
  bool listDevices = false, listMaterials = false;
  std::string printScene;  // instead of serving; empty: none

  std::string logLevel = "info";
  std::optional<std::chrono::duration<double>> stopAfter;
};

// The options, or with what to exit (help, version, or a wrong option: what there is to say has been
// printed).
std::variant<ProgramOptions, int> parseOptions(int argc, const char* const* argv);

}  // namespace clothstream
