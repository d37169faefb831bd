// SPDX-License-Identifier: MIT
// Reads and writes the header and the frames.
#include "clients/files/motion_file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "clients/files/regular_file.h"

namespace clothstream::files {
namespace {

static_assert(std::endian::native == std::endian::little);

using Header = std::array<std::int32_t, 4>;

std::uint64_t planeBytes(const MotionShape& shape) {
  return std::uint64_t{shape.vertexCount()} * 3 * sizeof(float);
}

// Offset of the positions of a frame. For `frame` = shape.frames: length of the file.
std::uint64_t offset(const MotionShape& shape, std::uint32_t frame) {
  return sizeof(Header) + frame * 2 * planeBytes(shape);
}

std::string notAMotion(const std::string& path, const std::string& why) {
  return fmt::format("{} is not a motion file: {}", path, why);
}

}  // namespace

double meanEdge(const MotionShape& shape, std::span<const float> positions) {
  double sum = 0, count = 0;
  const auto add = [&](std::size_t a, std::size_t b) {
    const auto along = [&](std::size_t c) {
      return double{positions[3 * b + c]} - double{positions[3 * a + c]};
    };
    sum += std::hypot(along(0), along(1), along(2));
    count += 1;
  };
  for (std::size_t row = 0; row < shape.rows; ++row)
    for (std::size_t column = 0; column < shape.columns; ++column) {
      const std::size_t vertex = row * shape.columns + column;
      if (column + 1 < shape.columns) add(vertex, vertex + 1);
      if (row + 1 < shape.rows) add(vertex, vertex + shape.columns);
    }
  return count > 0 ? sum / count : 0;
}

MotionReader::MotionReader(std::string path, std::ifstream file, const MotionShape& shape)
    : path_(std::move(path)),
      file_(std::move(file)),
      shape_(shape),
      positions_(3 * std::size_t{shape.vertexCount()}) {}

tl::expected<MotionReader, std::string> MotionReader::open(const std::string& path) {
  auto file = openRegularFile(path);
  if (!file) return tl::unexpected(std::move(file.error()));
  Header header{};
  if (!file->stream.read(reinterpret_cast<char*>(header.data()), sizeof header))
    return tl::unexpected(notAMotion(
        path, fmt::format("it has {} bytes, but its header needs {}", file->bytes, sizeof header)));
  const auto& [columns, rows, frames, zero] = header;
  if (columns < 1 || rows < 1 || frames < 1 || zero != 0)
    return tl::unexpected(
        notAMotion(path, fmt::format("its header has {} columns, {} rows, {} frames and {}; expected "
                                     "at least 1 of each and then 0",
                                     columns, rows, frames, zero)));
  if (std::int64_t{columns} * rows > codec::kMaxVertices)
    return tl::unexpected(
        notAMotion(path, fmt::format("its header has {}x{} vertices; at most {} are allowed", columns, rows,
                                     codec::kMaxVertices)));
  const MotionShape shape{static_cast<std::uint32_t>(columns), static_cast<std::uint32_t>(rows),
                          static_cast<std::uint32_t>(frames)};
  if (const std::uint64_t whole = offset(shape, shape.frames); file->bytes != whole)
    return tl::unexpected(notAMotion(path, fmt::format("it has {} bytes; {} frames of {}x{} vertices need {}",
                                                       file->bytes, frames, columns, rows, whole)));
  return MotionReader(path, std::move(file->stream), shape);
}

tl::expected<void, std::string> MotionReader::read(std::uint32_t frame, std::uint64_t offset,
                                                   std::vector<float>& out) {
  file_.seekg(static_cast<std::streamoff>(offset));
  if (!file_.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(planeBytes(shape_))))
    return tl::unexpected(fmt::format("cannot read frame {1} of {0}", path_, frame));
  return {};
}

tl::expected<std::span<const float>, std::string> MotionReader::next() {
  if (auto done = read(frame_, offset(shape_, frame_), positions_); !done)
    return tl::unexpected(std::move(done.error()));
  const auto wrong = std::ranges::find_if_not(positions_, [](float x) { return std::isfinite(x); });
  if (wrong != positions_.end())
    return tl::unexpected(
        notAMotion(path_, fmt::format("in frame {} (of 0 to {}), vertex {} has the coordinate {}", frame_,
                                      shape_.frames - 1, (wrong - positions_.begin()) / 3, *wrong)));
  ++frame_;
  return positions_;
}

tl::expected<std::span<const float>, std::string> MotionReader::normals() {
  normals_.resize(positions_.size());
  if (auto done = read(frame_ - 1, offset(shape_, frame_ - 1) + planeBytes(shape_), normals_); !done)
    return tl::unexpected(std::move(done.error()));
  return normals_;
}

tl::expected<MotionWriter, std::string> MotionWriter::create(const std::string& path,
                                                             const MotionShape& shape) {
  auto file = NewFile::create(path);
  if (!file) return tl::unexpected(std::move(file.error()));
  const Header header{static_cast<std::int32_t>(shape.columns), static_cast<std::int32_t>(shape.rows),
                      static_cast<std::int32_t>(shape.frames), 0};
  if (auto written = file->write(std::as_bytes(std::span(header))); !written)
    return tl::unexpected(std::move(written.error()));
  return MotionWriter(std::move(*file));
}

tl::expected<void, std::string> MotionWriter::append(std::span<const float> positions,
                                                     std::span<const float> normals) {
  return file_.write(std::as_bytes(positions)).and_then([&] { return file_.write(std::as_bytes(normals)); });
}

}  // namespace clothstream::files
