// SPDX-License-Identifier: MIT
// Motion files of a grid: int32 columns, rows, frames, 0; then per frame float32 positions (m) and float32
// normals, 3 numbers a vertex, row-major. Little-endian; 72 frames a second.
#pragma once

#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/files/new_file.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::files {

inline constexpr std::uint32_t kMotionRate = 72;

struct MotionShape {
  std::uint32_t columns = 0, rows = 0, frames = 0;

  std::uint32_t vertexCount() const { return columns * rows; }
  codec::ClothLayout cloth() const { return {vertexCount(), rows, columns, {}}; }
};

// Mean length of the edges between neighbours in rows and columns, m. 0 without edges.
double meanEdge(const MotionShape& shape, std::span<const float> positions);

// Reads frame by frame. Errors name the path and the problem.
class MotionReader {
 public:
  // Checks that the length of the file matches its header.
  [[nodiscard]] static tl::expected<MotionReader, std::string> open(const std::string& path);

  const MotionShape& shape() const { return shape_; }
  // Positions of the next frame; all are finite. Valid until the next call. Call it at most shape().frames
  // times.
  [[nodiscard]] tl::expected<std::span<const float>, std::string> next();
  // Normals of the frame that next() returned, unchecked. Valid until the next call.
  [[nodiscard]] tl::expected<std::span<const float>, std::string> normals();

 private:
  MotionReader(std::string path, std::ifstream file, const MotionShape& shape);
  [[nodiscard]] tl::expected<void, std::string> read(std::uint32_t frame, std::uint64_t offset,
                                                     std::vector<float>& out);

  std::string path_;
  std::ifstream file_;
  MotionShape shape_;
  std::uint32_t frame_ = 0;  // next frame
  std::vector<float> positions_, normals_;
};

class MotionWriter {
 public:
  // Errors as in NewFile.
  [[nodiscard]] static tl::expected<MotionWriter, std::string> create(const std::string& path,
                                                                      const MotionShape& shape);
  // Both have 3 floats per vertex.
  [[nodiscard]] tl::expected<void, std::string> append(std::span<const float> positions,
                                                       std::span<const float> normals);
  // Call it after all frames of the shape.
  [[nodiscard]] tl::expected<void, std::string> finish() { return file_.finish(); }

 private:
  explicit MotionWriter(NewFile file) : file_(std::move(file)) {}

  NewFile file_;
};

}  // namespace clothstream::files
