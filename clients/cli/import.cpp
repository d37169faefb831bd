// SPDX-License-Identifier: MIT
// Encodes each frame as a server would and writes it to a recording.
#include "clients/cli/import.h"

#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "clients/cli/checked_encoder.h"
#include "clients/cli/error.h"
#include "clients/cli/print.h"
#include "clients/cli/progress.h"
#include "clients/cli/signals.h"
#include "clothstream/v1/session.pb.h"
#include "proto/recording/file.h"
#include "proto/recording/recording_writer.h"

namespace clothstream::cli {
namespace {

constexpr std::uint32_t kEpoch = 1;
constexpr double kMaxStreamRate = 1000;  // ticks per second of a stream

std::vector<std::uint32_t> trianglesOf(const measure::Surface& surface, const measure::Cloth& cloth) {
  std::vector<std::uint32_t> triangles;
  for (std::size_t i = 0; i < cloth.triangleCount; ++i)
    for (const std::uint32_t vertex : surface.triangles[cloth.firstTriangle + i])
      triangles.push_back(vertex - cloth.firstVertex);
  return triangles;
}

std::vector<float> restOf(const measure::Surface& surface, const measure::Cloth& cloth) {
  const auto first = surface.rest.begin() + 3 * std::ptrdiff_t{cloth.firstVertex};
  return {first, first + 3 * std::ptrdiff_t{cloth.vertexCount}};
}

codec::StreamLayout layoutOf(const measure::Surface& surface, double maxError) {
  codec::StreamLayout layout{.epoch = kEpoch, .maxError = static_cast<float>(maxError), .cloths = {}};
  for (const measure::Cloth& cloth : surface.cloths) {
    const bool isGrid = cloth.rows > 0;
    layout.cloths.push_back({cloth.vertexCount, cloth.rows, cloth.columns,
                             isGrid ? std::vector<std::uint32_t>() : trianglesOf(surface, cloth),
                             isGrid ? std::vector<float>() : restOf(surface, cloth)});
  }
  return layout;
}

v1::StreamDescription descriptionOf(const Motion& motion, const codec::StreamLayout& layout,
                                    const std::string& scene) {
  v1::StreamDescription description;
  description.set_epoch(layout.epoch);
  description.set_codec(layout.codec);
  description.set_scene(scene);
  description.set_simulation_rate(static_cast<std::uint32_t>(motion.rate()));
  description.set_stream_rate(static_cast<std::uint32_t>(motion.rate()));
  description.set_max_error(layout.maxError);
  description.set_normals(v1::NORMALS_NONE);
  description.set_qualities(layout.qualities);
  const measure::Surface& surface = motion.surface();
  for (std::size_t i = 0; i < surface.cloths.size(); ++i) {
    const std::vector<float> rest = restOf(surface, surface.cloths[i]);
    const std::vector<std::uint32_t>& triangles = layout.cloths[i].triangles;
    v1::ClothDescription& cloth = *description.add_cloths();
    cloth.set_name(surface.cloths[i].name);
    cloth.set_vertex_count(layout.cloths[i].vertexCount);
    cloth.set_rows(layout.cloths[i].rows);
    cloth.set_columns(layout.cloths[i].columns);
    cloth.set_rest_positions(rest.data(), rest.size() * sizeof(float));
    cloth.set_triangles(triangles.data(), triangles.size() * sizeof(std::uint32_t));
  }
  return description;
}

class Import {
 public:
  Import(const ImportOptions& options, Motion& motion)
      : options_(options), motion_(motion), layout_(layoutOf(motion.surface(), options.maxError)) {}

  // Largest distance of a decoded vertex from its place, and the largest that was promised. Metres.
  double largestError() const { return largestError_; }
  double promise() const { return promise_; }

  // Returns the number of frames.
  tl::expected<std::uint32_t, Error> run() {
    if (!(motion_.rate() <= kMaxStreamRate) || std::floor(motion_.rate()) != motion_.rate())
      return makeError(kUsage, "--rate: {} is not allowed; a recording has 1 to {} whole ticks per second",
                       motion_.rate(), kMaxStreamRate);
    auto encoder = CheckedEncoder::make(layout_, options_.states);
    if (!encoder) return tl::unexpected(encoder.error());
    auto file = orError(kNotWritten, recording::OutputFile::create(options_.output));
    if (!file) return tl::unexpected(file.error());
    auto frames = write(*file, *encoder);
    if (!frames) std::filesystem::remove(options_.output);
    largestError_ = encoder->largestError();
    promise_ = encoder->promise();
    return frames;
  }

 private:
  tl::expected<std::uint32_t, Error> write(recording::OutputFile& file, CheckedEncoder& encoder) {
    auto writer = orError(kNotWritten, recording::RecordingWriter::begin(
                                           [&](std::string_view bytes) { return file.write(bytes); },
                                           options_.program, metadata()));
    if (!writer) return tl::unexpected(writer.error());
    const std::string description = descriptionOf(motion_, layout_, options_.scene).SerializeAsString();
    Progress progress("import", static_cast<std::uint32_t>(motion_.frames()));
    std::uint32_t frames = 0;
    for (;; ++frames) {
      if (interrupted()) return makeError(kNotWritten, "interrupted; {} was not written", options_.output);
      const auto more = motion_.next();
      if (!more) return tl::unexpected(more.error());
      if (!*more) break;
      const std::uint64_t time = timeOf(motion_.frame());
      if (frames == 0) {
        if (auto written =
                orError(kNotWritten, writer->write(recording::Topic::description, time, description));
            !written)
          return tl::unexpected(written.error());
      }
      const bool key = frames % recording::kMaxKeyFrameDistance == 0;
      const auto packet =
          encoder.encode(motion_.frame().tick, key ? codec::PacketKind::key : codec::PacketKind::predicted,
                         motion_.frame().positions);
      if (!packet) return tl::unexpected(packet.error());
      v1::Frame& frame = *message_.mutable_frame();
      frame.set_packet(packet->data(), packet->size());
      frame.set_tick_time_us(time / 1000);
      frame.set_packet_time_us(time / 1000);
      frame.set_reconstruction_hash(encoder.reconstructionHash());
      if (auto written = orError(kNotWritten, writer->write(time, message_)); !written)
        return tl::unexpected(written.error());
      progress.show(frames);
    }
    if (auto done = orError(kNotWritten, writer->finish().and_then([&] { return file.sync(); })); !done)
      return tl::unexpected(done.error());
    return frames;
  }

  // Simulated time, so that equal motions make equal files. Nanoseconds.
  static std::uint64_t timeOf(const MotionFrame& frame) {
    return static_cast<std::uint64_t>(std::llround(frame.seconds * 1e9));
  }

  recording::Metadata metadata() const {
    return {{"server", "none: imported"},
            {"scene", options_.scene},
            {"device", "none: imported"},
            {"codec", fmt::format("{}", layout_.codec)},
            {"max_error", fmt::format("{}", layout_.maxError)},
            {"vertices", fmt::format("{}", layout_.vertexCount())},
            {"simulation_rate", fmt::format("{}", motion_.rate())},
            {"stream_rate", fmt::format("{}", motion_.rate())}};
  }

  const ImportOptions& options_;
  Motion& motion_;
  const codec::StreamLayout layout_;
  double largestError_ = 0, promise_ = 0;
  v1::ServerMessage message_;
};

}  // namespace

ExitCode importStates(const ImportOptions& options) {
  auto motion = openArrays(options.states, options.arrays, options.limits.vertices);
  if (!motion) return printError(motion.error());
  Import importing(options, **motion);
  const auto frames = importing.run();
  if (!frames) return printError(frames.error());
  print("{}: {} frames, {} vertices; every vertex is within {:.3g} m of its place, promised were {:.3g} m\n",
        options.output, *frames, (*motion)->surface().vertexCount(), importing.largestError(),
        importing.promise());
  return kOk;
}

}  // namespace clothstream::cli
