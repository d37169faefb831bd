// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/files_target.h"

#include <cmath>

#include "clients/files/motion_file.h"
#include "clients/files/recording.h"
#include "proto/codec/decoder.h"
#include "tests/fuzz/targets/temporary_file.h"

namespace clothstream::fuzz {
namespace {

// A decoder needs memory in proportion to the vertices, of which a header of few bytes may name many.
constexpr std::uint32_t kMaxVertices = 16'384;

void readMotion(const std::string& path) {
  auto reader = files::MotionReader::open(path);
  if (!reader) return require(!reader.error().empty(), "an error has a text");
  for (std::uint32_t i = 0; i < reader->shape().frames; ++i) {
    const auto positions = reader->next();
    if (!positions) return;
    require(positions->size() == 3 * std::size_t{reader->shape().vertexCount()}, "a frame has all vertices");
    for (const float value : *positions) require(std::isfinite(value), "positions are finite");
    static_cast<void>(files::meanEdge(reader->shape(), *positions));
    static_cast<void>(reader->normals());
  }
}

void readStream(const std::string& path) {
  auto reader = files::RecordingReader::open(path);
  if (!reader) return require(!reader.error().empty(), "an error has a text");
  require(codec::isPossible(reader->head().layout), "the layout is possible");
  if (reader->head().layout.vertexCount() > kMaxVertices) return;
  const auto decoder = codec::Decoder::make(reader->head().layout);
  require(decoder != nullptr, "there is a decoder for every possible layout");
  for (std::uint32_t i = 0; i < reader->head().frames; ++i) {
    const auto packet = reader->next();
    if (!packet) return;
    static_cast<void>(decoder->decode(packet->packet()));
  }
}

void run(std::span<const std::byte> input) {
  if (input.empty()) return;
  const bool motion = (input[0] & std::byte{1}) == std::byte{0};
  const TemporaryFile file(motion ? ".motion" : ".stream", input.subspan(1));
  motion ? readMotion(file.path()) : readStream(file.path());
}

}  // namespace

const Target kFilesTarget{.name = "files", .run = &run};

}  // namespace clothstream::fuzz
