// SPDX-License-Identifier: MIT
// A stream as a file: "clothstream\n"; the number of frames and one of Side (uint32, little-endian); then
// messages of session.proto, each behind its length as a varint: a StreamDescription without rest positions,
// then a Frame for each, with its packet and its reconstruction hash.
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

// Where normals point to: as computeVertexNormals() has them, or the other way.
enum class Side : std::uint32_t { front = 0, back = 1 };

// What is known before the first frame.
struct RecordingHead {
  codec::StreamLayout layout;  // possible (stream_layout.h); all cloths are grids
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
  // Errors as NewFile's.
  [[nodiscard]] static tl::expected<RecordingWriter, std::string> create(const std::string& path,
                                                                         const RecordingHead& head);
  [[nodiscard]] tl::expected<void, std::string> append(std::span<const std::byte> packet,
                                                       std::uint64_t reconstructionHash);
  // After all frames.
  [[nodiscard]] tl::expected<void, std::string> finish() { return file_.finish(); }
  std::uint64_t bytes() const { return file_.bytes(); }

 private:
  explicit RecordingWriter(NewFile file) : file_(std::move(file)) {}

  NewFile file_;
};

// Safe on any bytes. Errors name the path and what is wrong with the file.
class RecordingReader {
 public:
  [[nodiscard]] static tl::expected<RecordingReader, std::string> open(const std::string& path);
  ~RecordingReader();
  RecordingReader(RecordingReader&&) noexcept;
  RecordingReader& operator=(RecordingReader&&) = delete;

  const RecordingHead& head() const;
  // The next frame's, of which there must be one. With the last it is known that nothing follows.
  [[nodiscard]] tl::expected<RecordedPacket, std::string> next();

 private:
  struct State;
  explicit RecordingReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::files
