// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/gltf_target.h"

#include "server/meshes/mesh_file.h"
#include "tests/fuzz/targets/built_mesh.h"
#include "tests/fuzz/targets/temporary_file.h"

namespace clothstream::fuzz {
namespace {

constexpr meshes::FileLimits kLimits{.bytes = 1 << 20, .vertices = 16'384};

void run(std::span<const std::byte> input) {
  const bool binary = textOf(input).starts_with("glTF");
  const TemporaryFile file(binary ? ".glb" : ".gltf", input);
  if (const auto source = meshes::readMeshFile(file.path(), kLimits)) buildAndCheck(*source);
}

}  // namespace

const Target kGltfTarget{.name = "gltf", .run = &run};

}  // namespace clothstream::fuzz
