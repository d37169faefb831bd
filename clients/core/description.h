// SPDX-License-Identifier: MIT
// What a stream shows: cloths, rest state, triangles, colliders and the parameters as they stand now.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/core/collider.h"
#include "clients/core/parameter_change.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::client {

// Triangles that are drawn with one material.
struct Submesh {
  std::string name;
  std::uint32_t firstIndex = 0, indexCount = 0;  // of the description's triangles
};

struct Cloth {
  std::string name;
  std::uint32_t firstVertex = 0, firstIndex = 0, indexCount = 0;
  std::vector<float> uvs;                // 2 each; of meshes that have any
  std::vector<std::uint32_t> uvIndices;  // one a corner of the cloth's triangles, where there are uvs
  std::vector<Submesh> submeshes;        // of meshes; together all of its triangles
  ClothParameters parameters;
};

struct Environment {
  Vec3 gravity{0, -9.81f, 0};
  Vec3 wind{};
  float airDensity = 1.2f;
  Gust gust;
};

struct Description {
  std::uint32_t codec = 0;
  std::string scene;
  std::uint32_t simulationRate = 0, streamRate = 0;
  codec::StreamLayout layout;  // vertex counts, rows and columns, or triangles, of the cloths
  std::vector<Cloth> cloths;
  std::vector<Collider> colliders;
  std::map<std::string, Hull> hulls;  // of the colliders that are hulls, by name
  Environment environment;
  std::vector<std::string> materials;             // that the server has
  std::vector<float> restPositions, restNormals;  // 3 a vertex
  std::vector<std::uint32_t> triangles;           // 3 indices each

  std::uint32_t ticksPerFrame() const { return simulationRate / streamRate; }
};

// A serialised StreamDescription. Sizes what it makes by the positions that came, never by numbers alone. The
// error names the field, its value and what is allowed.
[[nodiscard]] tl::expected<Description, std::string> readDescription(Bytes message);

// nullptr where the collider is no hull of this description.
const Hull* hullOf(const Collider& collider, const Description& description);

void apply(const ParameterChange& change, Description& description);

// The ids of all codecs, for a text.
std::string decodedCodecs();

}  // namespace clothstream::client
