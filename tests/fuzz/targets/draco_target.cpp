// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/draco_target.h"

#include "server/meshes/draco_mesh.h"

namespace clothstream::fuzz {
namespace {

constexpr meshes::DracoRequest kRequest{.positions = 0, .uvs = 1, .maxPoints = 4096, .maxFaces = 8192};

void run(std::span<const std::byte> input) {
  const auto mesh = meshes::decodeDraco(input, kRequest);
  if (!mesh) return require(!mesh.error().empty(), "an error has a text");
  require(mesh->positions.size() <= kRequest.maxPoints, "no more points than requested");
  require(mesh->uvs.size() == mesh->positions.size(), "each point has a texture coordinate");
  require(mesh->indices.size() <= 3 * kRequest.maxFaces && mesh->indices.size() % 3 == 0,
          "no more faces than requested");
  for (const std::uint32_t point : mesh->indices)
    require(point < mesh->positions.size(), "faces name points");
}

}  // namespace

const Target kDracoTarget{.name = "draco", .run = &run};

}  // namespace clothstream::fuzz
