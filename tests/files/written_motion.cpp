// SPDX-License-Identifier: MIT
#include "tests/files/written_motion.h"

#include <array>
#include <fstream>

#include "tests/codec/motion.h"

namespace clothstream::files {

MotionContent waves(const MotionShape& shape) {
  MotionContent content{shape, {}};
  const codec::StreamLayout layout{.epoch = 1, .cloths = {shape.cloth()}};
  for (std::uint32_t frame = 0; frame < shape.frames; ++frame) {
    const codec::MotionFrame sample = codec::sampleMotion(layout, frame, 0.05f);
    content.floats.insert(content.floats.end(), sample.positions.begin(), sample.positions.end());
    content.floats.insert(content.floats.end(), sample.normals.begin(), sample.normals.end());
  }
  return content;
}

void writeMotion(const MotionContent& content, const std::filesystem::path& path) {
  const std::array<std::uint32_t, 4> header{content.shape.columns, content.shape.rows, content.shape.frames,
                                            0};
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(header.data()), sizeof header);
  file.write(reinterpret_cast<const char*>(content.floats.data()),
             static_cast<std::streamsize>(content.floats.size() * sizeof(float)));
}

MotionContent readMotion(const std::filesystem::path& path) {
  std::array<std::uint32_t, 4> header{};
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(header.data()), sizeof header);
  MotionContent content{{header[0], header[1], header[2]}, {}};
  content.floats.resize((std::filesystem::file_size(path) - sizeof header) / sizeof(float));
  file.read(reinterpret_cast<char*>(content.floats.data()),
            static_cast<std::streamsize>(content.floats.size() * sizeof(float)));
  return content;
}

}  // namespace clothstream::files
