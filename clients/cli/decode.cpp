// SPDX-License-Identifier: MIT
// For each frame: read, decode, compare the hash, write.
#include "clients/cli/decode.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include <fmt/format.h>

#include "clients/cli/error.h"
#include "clients/cli/print.h"
#include "clients/cli/progress.h"
#include "clients/cli/signals.h"
#include "clients/files/motion_file.h"
#include "clients/files/recording.h"
#include "proto/codec/decoder.h"

namespace clothstream::cli {
namespace {

template <typename T>
using Expected = tl::expected<T, Error>;

const char* problem(codec::DecodeResult result) {
  switch (result) {
    case codec::DecodeResult::ok:
      return "decodes to something else than was encoded";
    case codec::DecodeResult::malformed:
      return "is not a packet of this stream";
    case codec::DecodeResult::wrongEpoch:
      return "belongs to another stream";
    case codec::DecodeResult::missingReference:
      return "refers to a missing frame";
    case codec::DecodeResult::stale:
      return "is not newer than the frame before";
  }
  return "cannot be decoded";
}

struct DecodeFigures {
  files::MotionShape shape;
  double milliseconds = 0;  // decoding time, including normals
};

Expected<DecodeFigures> decodeFile(const DecodeOptions& options) {
  auto recording = orError(kUnreadable, files::RecordingReader::open(options.recording));
  if (!recording) return tl::unexpected(recording.error());
  const codec::StreamLayout& layout = recording->head().layout;
  if (layout.cloths.size() != 1 || layout.cloths[0].rows == 0)
    return makeError(kUnreadable, "{} has {} cloths; a motion file holds one grid", options.recording,
                     layout.cloths.size());
  if (layout.cloths[0].vertexCount > options.maxVertices)
    return makeError(kUnreadable, "{} has {} vertices; at most {} are allowed (--max-vertices)",
                     options.recording, layout.cloths[0].vertexCount, options.maxVertices);
  if (auto apart = areDifferent(options.recording, options.out); !apart) return tl::unexpected(apart.error());
  const codec::ClothLayout& cloth = layout.cloths[0];
  DecodeFigures figures{{cloth.columns, cloth.rows, recording->head().frames}};
  const auto decoder = codec::Decoder::make(layout);
  if (!decoder) return makeError(kFailed, "not enough memory for {} vertices", cloth.vertexCount);
  auto out = orError(kNotWritten, files::MotionWriter::create(options.out, figures.shape));
  if (!out) return tl::unexpected(out.error());
  const float sign = recording->head().side == files::Side::back ? -1.0f : 1.0f;
  std::vector<float> normals(3 * std::size_t{cloth.vertexCount});
  Progress progress("decode", figures.shape.frames);
  for (std::uint32_t frame = 0; frame < figures.shape.frames; ++frame) {
    if (interrupted())
      return makeError(kNotWritten, "interrupted in frame {}; {} was not written", frame, options.out);
    const auto packet = orError(kUnreadable, recording->next());
    if (!packet) return tl::unexpected(packet.error());
    const auto start = std::chrono::steady_clock::now();
    const codec::DecodeResult result = decoder->decode(packet->packet());
    if (result != codec::DecodeResult::ok || decoder->reconstructionHash() != packet->reconstructionHash)
      return makeError(kUnreadable, "{} is broken: frame {} {}", options.recording, frame, problem(result));
    std::ranges::transform(decoder->normals(), normals.begin(), [=](float x) { return sign * x; });
    figures.milliseconds +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    if (auto done = orError(kNotWritten, out->append(decoder->positions(), normals)); !done)
      return tl::unexpected(done.error());
    progress.show(frame + 1);
  }
  if (auto done = orError(kNotWritten, out->finish()); !done) return tl::unexpected(done.error());
  return figures;
}

}  // namespace

ExitCode decode(const DecodeOptions& options) {
  const auto figures = decodeFile(options);
  if (!figures) return printError(figures.error());
  const files::MotionShape& shape = figures->shape;
  print("{}: {}x{} vertices, {} frames; {:.3f} ms to decode a frame, including normals\n", options.out,
        shape.columns, shape.rows, shape.frames, figures->milliseconds / shape.frames);
  return kOk;
}

}  // namespace clothstream::cli
