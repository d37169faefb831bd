// SPDX-License-Identifier: MIT
// Compares what two recorded runs were given: scene, input of each tick, parameters and participants.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "clients/cli/error.h"
#include "proto/recording/recording_reader.h"
#include "proto/recording/verdict.h"

namespace clothstream::cli {

// First difference of one kind of input.
struct InputDifference {
  std::optional<std::uint64_t> tick;  // absent if the input has no tick
  std::string text;                   // empty: no difference
};

struct ComparedInput {
  recording::Kernels kernels = recording::Kernels::unknown;
  std::array<std::string, 2> devices;  // name and driver
  InputDifference scene, ticks, parameters, participants;
  // Ticks of the simulation, which only recordings of servers have.
  std::uint64_t commonTicks = 0;
  std::array<std::uint64_t, 2> onlyTicks{};     // ticks only in the first, only in the second
  std::uint64_t differentTicks = 0;             // ticks with another hash of the state
  std::optional<std::uint64_t> firstDifferent;  // the first of them
  std::array<std::uint64_t, 2> unreadable{};    // messages that are not of their channel's type
};

// Chunks that cannot be read are passed; compareFrames() notes them.
[[nodiscard]] tl::expected<ComparedInput, Error> compareInput(const std::array<std::string, 2>& paths,
                                                              const recording::ReadLimits& limits);

}  // namespace clothstream::cli
