// SPDX-License-Identifier: MIT
// Motion files for tests.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "clients/files/motion_file.h"

namespace clothstream::files {

struct MotionContent {
  MotionShape shape;
  std::vector<float> floats;  // per frame: positions, then normals

  std::span<const float> positions(std::uint32_t frame) const { return plane(2 * frame); }
  std::span<const float> normals(std::uint32_t frame) const { return plane(2 * frame + 1); }

 private:
  std::span<const float> plane(std::size_t index) const {
    const std::size_t size = 3 * std::size_t{shape.vertexCount()};
    return std::span(floats).subspan(index * size, size);
  }
};

// Waves that travel over a cloth.
MotionContent waves(const MotionShape& shape);

// Written and read independently of MotionWriter and MotionReader.
void writeMotion(const MotionContent& content, const std::filesystem::path& path);
MotionContent readMotion(const std::filesystem::path& path);

}  // namespace clothstream::files
