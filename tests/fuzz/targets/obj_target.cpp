// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/obj_target.h"

#include "server/meshes/mesh_file.h"
#include "tests/fuzz/targets/built_mesh.h"

namespace clothstream::fuzz {
namespace {

void run(std::span<const std::byte> input) {
  if (const auto source = meshes::parseObj(textOf(input))) buildAndCheck(*source);
}

}  // namespace

const Target kObjTarget{.name = "obj", .run = &run};

}  // namespace clothstream::fuzz
