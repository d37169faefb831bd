// SPDX-License-Identifier: MIT
// Commands of clothstream-server. Each returns the exit code of the process, and throws an exception that
// explains why the command failed.
#pragma once

#include "server/options/program_options.h"
#include "server/program/signals.h"

namespace clothstream::program {

// Simulates and serves scenes.
int serve(const ProgramOptions& options, const Signals& signals);
// Serves a recording.
int play(const ProgramOptions& options, const Signals& signals);
// Serves scenes of other servers.
int edge(const ProgramOptions& options, const Signals& signals);
// Simulates a recording again and compares the result.
int resimulate(const ProgramOptions& options, const Signals& signals);
// Writes ticks of a scene into a file.
int runSteps(const ProgramOptions& options, const Signals& signals);

// Makes a token or a key of tokens.
int runToken(const ProgramOptions& options);

// Checks the devices, the machine and the configuration.
int runDoctor(const ProgramOptions& options, const Signals& signals);

int printScene(const ProgramOptions& options);
int listDevices();
int listMaterials();

}  // namespace clothstream::program
