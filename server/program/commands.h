// SPDX-License-Identifier: MIT
// Commands of clothstream-server. Each returns the exit code of the process, and throws an exception that
// explains why the command failed.
#pragma once

#include <string>

#include "server/options/program_options.h"
#include "server/program/signals.h"
#include "server/vulkan/device.h"

namespace clothstream::program {

// Simulates and serves scenes.
int serve(const ServeOptions& options, const Signals& signals);
// Serves a recording.
int play(const ServeOptions& options, const PlayOptions& play, const Signals& signals);
// Serves scenes of other servers.
int edge(const ServeOptions& options, const Signals& signals);
// Simulates a recording again and compares the result.
int resimulate(const ResimulateOptions& options, const vulkan::DeviceOptions& device, const Signals& signals);
// Writes ticks of a scene into a file.
int runSteps(const StepOptions& options, const vulkan::DeviceOptions& deviceOptions, const Signals& signals);

// Makes a token for this audience, or a key of tokens.
int runToken(const TokenOptions& token, const std::string& audience);

// Checks the devices, the machine and the configuration.
int runDoctor(const ServeOptions& options, const DoctorOptions& command, const Signals& signals);

int printScene(const std::string& nameOrPath);
int listDevices();
int listMaterials();

}  // namespace clothstream::program
