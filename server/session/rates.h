// SPDX-License-Identifier: MIT
// Rates that bound the messages of one peer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/schedule/token_bucket.h"

namespace clothstream::session {

enum class Rate : std::uint8_t {
  poses,
  changes,
  keyFrames,
  pings,
  queries,
  control,
  surfaces,
  surfaceParts,
  messages,  // of all kinds
  offences,  // refused messages, by their cost
  errors,    // Error messages; further refusals are only counted
  count,
};

// One bucket for each rate, in the order of Rate, all full: tokens per second, and in a burst.
inline constexpr std::array<schedule::TokenBucket, static_cast<std::size_t>(Rate::count)> kFullBuckets = {{
    {480, 120},   // poses
    {60, 30},     // changes
    {1, 3},       // keyFrames
    {20, 150},    // pings: clients send many at the start
    {20, 20},     // queries
    {10, 10},     // control
    {200, 400},   // surfaces: parts of meshes, which are many after joining, and poses
    {100, 100},   // surfaceParts: of others
    {1000, 500},  // messages
    {100, 500},   // offences
    {50, 50},     // errors
}};

}  // namespace clothstream::session
