// SPDX-License-Identifier: MIT
// Compares the frames of two recordings tick by tick.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/cli/error.h"
#include "proto/recording/recording_reader.h"

namespace clothstream::cli {

// Distance of one vertex between two recordings.
struct VertexDistance {
  std::uint64_t tick = 0;
  double seconds = 0;        // since the start of the first recording
  std::string cloth;         // name
  std::uint32_t vertex = 0;  // index in the cloth
  double metres = 0;
};

struct ComparedFrames {
  std::uint64_t common = 0;             // frames whose tick is in both recordings
  std::array<std::uint64_t, 2> only{};  // frames whose tick is only in the first, only in the second
  // Frames in which a position, or the hash of the simulation's exact state, differs.
  std::uint64_t different = 0;
  std::optional<std::uint64_t> firstDifferent;  // tick
  VertexDistance first;                         // the farthest vertex of that tick
  VertexDistance largest;                       // the farthest vertex of all common frames
  double mean = 0;                              // over all vertices of all common frames, metres
  // First tick with other colliders, and what differs in them.
  std::optional<std::uint64_t> firstCollider;
  std::string collider;
  std::array<double, 2> maxError{};  // of the streams along each axis, metres
  std::array<float, 2> farthest{};   // largest magnitudes of a coordinate in common frames, metres
  std::array<std::vector<std::string>, 2> damaged{};  // parts that could not be read or decoded
};

// Paths of the two recordings. An error means that there is nothing to compare: one cannot be read at all, or
// they show different cloths.
[[nodiscard]] tl::expected<ComparedFrames, Error> compareFrames(const std::array<std::string, 2>& paths,
                                                                const recording::ReadLimits& limits);

}  // namespace clothstream::cli
