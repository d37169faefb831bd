// SPDX-License-Identifier: MIT
// For each frame: read, encode, decode, compare, write.
#include "clients/cli/encode.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/checked_encoder.h"
#include "clients/cli/error.h"
#include "clients/cli/json_text.h"
#include "clients/cli/print.h"
#include "clients/cli/progress.h"
#include "clients/cli/signals.h"
#include "clients/files/motion_file.h"
#include "clients/files/recording.h"
#include "proto/codec/vertex_normals.h"

namespace clothstream::cli {
namespace {

template <typename T>
using Expected = tl::expected<T, Error>;

constexpr std::uint32_t kEpoch = 1;

Expected<float> maxErrorFor(const EncodeOptions& options, const files::MotionShape& shape,
                            std::span<const float> first) {
  const double edge = files::meanEdge(shape, first);
  if (!options.maxError && !(edge > 0))
    return makeError(
        kUnreadable,
        "{}: the edges of the first frame have no length, so a quality has no meaning; give --max-error",
        options.motion);
  const auto maxError = static_cast<float>(options.maxError.value_or(relativeError(options.quality) * edge));
  if (!(maxError >= codec::kSmallestMaxError && maxError <= codec::kLargestMaxError))
    return makeError(kUsage, "the max error is {} m; use {} to {} m", maxError, codec::kSmallestMaxError,
                     codec::kLargestMaxError);
  return maxError;
}

// Side of the cloth to which the normals of the first frame point.
Expected<files::Side> sideOf(files::MotionReader& motion, const codec::StreamLayout& layout,
                             std::span<const float> positions) {
  const auto given = orError(kUnreadable, motion.normals());
  if (!given) return tl::unexpected(given.error());
  std::vector<float> computed(positions.size());
  codec::computeVertexNormals(layout, positions.data(), computed.data());
  return std::inner_product(given->begin(), given->end(), computed.begin(), 0.0) < 0 ? files::Side::back
                                                                                     : files::Side::front;
}

// Results of encoding.
struct EncodeFigures {
  files::MotionShape shape;
  float maxError = 0;
  std::uint64_t packetBytes = 0, keyBytes = 0, fileBytes = 0;
  std::uint32_t keyFrames = 0;
  double largestError = 0, promise = 0, encodeMs = 0, decodeMs = 0;

  double bitsPerVertex(std::uint64_t bytes) const {
    return 8 * static_cast<double>(bytes) / (1.0 * shape.frames * shape.vertexCount());
  }

  std::string text(const std::string& out) const {
    const double seconds = 1.0 * shape.frames / files::kMotionRate;
    return fmt::format(
        "{}: {}x{} vertices, {} frames, {:.1f} s at {} Hz, max error {:.4g} mm\n"
        "{:.3f} bits a vertex a frame, {:.3f} including the rest of the file; {} bytes, {:.0f} kbit/s; {} "
        "key {} "
        "of {} bytes on average\n"
        "largest error of a vertex {:.4g} mm; promised {:.4g} mm\n"
        "{:.3f} ms to encode a frame, {:.3f} ms to decode it",
        out, shape.columns, shape.rows, shape.frames, seconds, files::kMotionRate, 1e3 * double{maxError},
        bitsPerVertex(packetBytes), bitsPerVertex(fileBytes), fileBytes,
        8e-3 * static_cast<double>(packetBytes) / seconds, keyFrames, keyFrames == 1 ? "frame" : "frames",
        keyBytes / keyFrames, 1e3 * largestError, 1e3 * promise, encodeMs / shape.frames,
        decodeMs / shape.frames);
  }

  std::string json() const {
    const nlohmann::ordered_json object{{"columns", shape.columns},
                                        {"rows", shape.rows},
                                        {"frames", shape.frames},
                                        {"maxErrorMm", 1e3 * double{maxError}},
                                        {"bitsPerVertex", bitsPerVertex(packetBytes)},
                                        {"fileBytes", fileBytes},
                                        {"keyFrames", keyFrames},
                                        {"keyBytes", keyBytes / keyFrames},
                                        {"measuredMaxErrorMm", 1e3 * largestError},
                                        {"promisedMaxErrorMm", 1e3 * promise},
                                        {"encodeMs", encodeMs / shape.frames},
                                        {"decodeMs", decodeMs / shape.frames}};
    return jsonText(object, 2);
  }
};

Expected<void> encodeFrame(CheckedEncoder& encoder, std::uint32_t frame, std::span<const float> positions,
                           const EncodeOptions& options, files::RecordingWriter& out,
                           EncodeFigures& figures) {
  const bool key = frame == 0 || (options.keyEvery > 0 && frame % options.keyEvery == 0);
  const auto packet =
      encoder.encode(frame + 1, key ? codec::PacketKind::key : codec::PacketKind::predicted, positions);
  if (!packet) return tl::unexpected(packet.error());
  figures.packetBytes += packet->size();
  figures.keyFrames += key ? 1 : 0;
  figures.keyBytes += key ? packet->size() : 0;
  return orError(kNotWritten, out.append(*packet, encoder.reconstructionHash()));
}

Expected<EncodeFigures> encodeFile(const EncodeOptions& options) {
  auto motion = orError(kUnreadable, files::MotionReader::open(options.motion));
  if (!motion) return tl::unexpected(motion.error());
  auto positions = orError(kUnreadable, motion->next());
  if (!positions) return tl::unexpected(positions.error());
  const auto maxError = maxErrorFor(options, motion->shape(), *positions);
  if (!maxError) return tl::unexpected(maxError.error());
  if (auto apart = areDifferent(options.motion, options.out); !apart) return tl::unexpected(apart.error());

  EncodeFigures figures{.shape = motion->shape(), .maxError = *maxError};
  const codec::StreamLayout layout{.epoch = kEpoch,
                                   .codec = codec::kCodecHierarchical,
                                   .maxError = *maxError,
                                   .cloths = {figures.shape.cloth()}};
  const auto side = sideOf(*motion, layout, *positions);
  if (!side) return tl::unexpected(side.error());
  auto out = orError(kNotWritten, files::RecordingWriter::create(options.out, {layout, files::kMotionRate,
                                                                               figures.shape.frames, *side}));
  if (!out) return tl::unexpected(out.error());
  auto encoder = CheckedEncoder::make(layout, options.motion);
  if (!encoder) return tl::unexpected(encoder.error());
  Progress progress("encode", figures.shape.frames);
  for (std::uint32_t frame = 0;;) {
    if (auto done = encodeFrame(*encoder, frame, *positions, options, *out, figures); !done)
      return tl::unexpected(done.error());
    progress.show(++frame);
    if (frame == figures.shape.frames) break;
    if (interrupted())
      return makeError(kNotWritten, "interrupted in frame {}; {} was not written", frame, options.out);
    positions = orError(kUnreadable, motion->next());
    if (!positions) return tl::unexpected(positions.error());
  }
  if (auto done = orError(kNotWritten, out->finish()); !done) return tl::unexpected(done.error());
  figures.fileBytes = out->bytes();
  figures.largestError = encoder->largestError();
  figures.promise = encoder->promise();
  figures.encodeMs = encoder->encodeMs();
  figures.decodeMs = encoder->decodeMs();
  return figures;
}

}  // namespace

ExitCode encode(const EncodeOptions& options) {
  const auto figures = encodeFile(options);
  if (!figures) return printError(figures.error());
  put((options.json ? figures->json() : figures->text(options.out)) + '\n');
  return kOk;
}

}  // namespace clothstream::cli
