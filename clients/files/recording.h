// SPDX-License-Identifier: MIT
// Stream file of `clothstream encode`: "clothstream\n"; then the number of frames and a Side, each as
// little-endian uint32; then messages of session.proto, each after its length as a varint. The first is a
// StreamDescription without rest positions. A Frame with packet and reconstruction hash follows for each
// frame.
#pragma once

#include <cstddef>
#include <cstdint>
#include <fstream>
#include <memory>
#include <span>
#include <string>

#include <tl/expected.hpp>

#include "clients/files/new_file.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::files {

// Direction of normals: as from computeVertexNormals(), or opposite.
enum class Side : std::uint32_t { front = 0, back = 1 };

// Header of the file.
struct RecordingHead {
  codec::StreamLayout layout;  // valid (stream_layout.h); all cloths are grids
  std::uint32_t rate = 0;      // frames a second
  std::uint32_t frames = 0;
  Side side = Side::front;
};

struct RecordedPacket {
  std::string bytes;
  std::uint64_t reconstructionHash = 0;

  std::span<const std::byte> packet() const { return std::as_bytes(std::span(bytes)); }
};

class RecordingWriter {
 public:
  // Errors as in NewFile.
  [[nodiscard]] static tl::expected<RecordingWriter, std::string> create(const std::string& path,
                                                                         const RecordingHead& head);
  [[nodiscard]] tl::expected<void, std::string> append(std::span<const std::byte> packet,
                                                       std::uint64_t reconstructionHash);
  // Call it after all frames.
  [[nodiscard]] tl::expected<void, std::string> finish() { return file_.finish(); }
  std::uint64_t bytes() const { return file_.bytes(); }

 private:
  explicit RecordingWriter(NewFile file) : file_(std::move(file)) {}

  NewFile file_;
};

// Safe on any bytes. Errors name the path and the problem.
class RecordingReader {
 public:
  [[nodiscard]] static tl::expected<RecordingReader, std::string> open(const std::string& path);
  ~RecordingReader();
  RecordingReader(RecordingReader&&) noexcept;
  RecordingReader& operator=(RecordingReader&&) = delete;

  const RecordingHead& head() const;
  // Packet of the next frame. The last call checks that nothing follows. Call it at most head().frames times.
  [[nodiscard]] tl::expected<RecordedPacket, std::string> next();

 private:
  struct State;
  explicit RecordingReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::files
