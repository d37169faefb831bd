// SPDX-License-Identifier: MIT
// clothstream-server: simulates scenes on a Vulkan device and serves them through two endpoints.
#include <cstdio>
#include <exception>
#include <string>
#include <variant>

#include <spdlog/spdlog.h>

#include "proto/text/printable.h"
#include "server/options/program_options.h"
#include "server/program/commands.h"
#include "server/program/out_of_memory.h"
#include "server/program/signals.h"
#include "server/telemetry/log.h"

namespace clothstream {
namespace {

bool servesClients(Command command) {
  return command == Command::serve || command == Command::play || command == Command::edge;
}

int run(const ProgramOptions& options, const program::Signals& signals) {
  const vulkan::DeviceOptions& device = options.serve.server.device;
  switch (options.command) {
    case Command::serve:
      return program::serve(options.serve, signals);
    case Command::play:
      return program::play(options.serve, options.play, signals);
    case Command::edge:
      return program::edge(options.serve, signals);
    case Command::resimulate:
      return program::resimulate(options.resimulate, device, signals);
    case Command::step:
      return program::runSteps(options.step, device, signals);
    case Command::printScene:
      return program::printScene(options.printScene);
    case Command::token:
      return program::runToken(options.token, options.serve.identity.tokenAudience);
    case Command::doctor:
      return program::runDoctor(options.serve, options.doctor, signals);
    case Command::listDevices:
      return program::listDevices();
    case Command::listMaterials:
      return program::listMaterials();
  }
  return 1;
}

}  // namespace
}  // namespace clothstream

int main(int argc, char** argv) {
  using namespace clothstream;
  try {
    const auto parsed = parseOptions(argc, argv);
    if (const int* code = std::get_if<int>(&parsed)) return *code;
    const ProgramOptions& options = std::get<ProgramOptions>(parsed);
    const program::Signals signals;
    telemetry::setUpLog(
        options.log.level,
        options.log.format == "json" ? telemetry::LogFormat::json : telemetry::LogFormat::text,
        options.serve.server.logRate);
    if (servesClients(options.command)) program::endWhenOutOfMemory(options.log);
    for (const std::string& warning : options.warnings) spdlog::warn("{}", warning);
    return run(options, signals);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "clothstream-server: %s\n", printableLines(error.what()).c_str());
    return 1;
  }
}
