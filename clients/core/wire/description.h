// SPDX-License-Identifier: MIT
// Description of a stream: cloths, rest state, triangles, colliders and current parameters.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/core/wire/collider.h"
#include "clients/core/wire/limits.h"
#include "clients/core/wire/parameter_change.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::client {

// Triangles with one material.
struct Submesh {
  std::string name;
  std::uint32_t firstIndex = 0, indexCount = 0;  // range in Description::triangles
};

struct Cloth {
  std::string name;
  std::uint32_t firstVertex = 0, firstIndex = 0, indexCount = 0;
  std::vector<float> uvs;                // 2 floats each; empty if there are none
  std::vector<std::uint32_t> uvIndices;  // one per triangle corner; empty without uvs
  std::vector<Submesh> submeshes;        // meshes only; they cover all triangles of the cloth
  ClothParameters parameters;
};

struct Description {
  std::uint32_t codec = 0;
  std::string scene;
  std::uint32_t simulationRate = 0, streamRate = 0;
  codec::StreamLayout layout;  // for each cloth: vertex count, and rows and columns or triangles
  std::vector<Cloth> cloths;
  std::vector<Collider> colliders;
  std::map<std::string, Hull> hulls;  // by the collider's name
  parameters::EnvironmentValues environment = parameters::initialEnvironment();
  std::vector<std::string> materials;             // names that the server offers
  std::vector<float> restPositions, restNormals;  // 3 floats per vertex
  std::vector<std::uint32_t> triangles;           // 3 indices per triangle

  std::uint32_t ticksPerFrame() const { return simulationRate / streamRate; }
};

// Reads a serialised StreamDescription, checks it, and adds triangles and normals. Memory grows with the
// positions in the message, not with the counts that it states, and stays within the limits. The error names
// the field, its value and the allowed values.
[[nodiscard]] tl::expected<Description, std::string> readDescription(Bytes message, const Limits& limits);

// Index of a cloth, and of one of its triangles in it.
struct ClothTriangle {
  std::uint32_t cloth = 0, triangle = 0;
};

// Returns the triangle with this index among all of the description, or nullopt for a larger index.
std::optional<ClothTriangle> triangleOf(std::uint32_t index, const Description& description);

// Returns nullptr if the collider is not a hull of this description.
const Hull* hullOf(const Collider& collider, const Description& description);

// Applies a change to the environment and to the cloths that it names; the name "" means all cloths.
void apply(const ParameterChange& change, Description& description);

}  // namespace clothstream::client
