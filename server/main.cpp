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
  switch (options.command) {
    case Command::serve:
      return program::serve(options, signals);
    case Command::play:
      return program::play(options, signals);
    case Command::edge:
      return program::edge(options, signals);
    case Command::resimulate:
      return program::resimulate(options, signals);
    case Command::step:
      return program::runSteps(options, signals);
    case Command::printScene:
      return program::printScene(options);
    case Command::token:
      return program::runToken(options);
    case Command::doctor:
      return program::runDoctor(options, signals);
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
    telemetry::setUpLog(options.logLevel,
                        options.logFormat == "json" ? telemetry::LogFormat::json : telemetry::LogFormat::text,
                        options.server.logRate);
    if (servesClients(options.command)) program::endWhenOutOfMemory(options);
    for (const std::string& warning : options.warnings) spdlog::warn("{}", warning);
    return run(options, signals);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "clothstream-server: %s\n", printableLines(error.what()).c_str());
    return 1;
  }
}
