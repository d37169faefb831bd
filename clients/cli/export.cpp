// SPDX-License-Identifier: MIT
// Exports frames at no more than the requested rate.
#include "clients/cli/export.h"

#include <algorithm>
#include <filesystem>
#include <functional>

#include <fmt/format.h>

#include "clients/cli/error.h"
#include "clients/cli/gltf_animation.h"
#include "clients/cli/npz_export.h"
#include "clients/cli/obj_file.h"
#include "clients/cli/print.h"
#include "clients/cli/progress.h"
#include "clients/cli/recording_limits.h"
#include "clients/cli/signals.h"
#include "clients/recording/played_recording.h"
#include "proto/recording/file.h"

namespace clothstream::cli {
namespace {

using client::PlayedRecording;
using Done = tl::expected<void, Error>;
// Takes a frame and its time in seconds since the first frame.
using TakeFrame = std::function<Done(const cs_client*, double)>;

tl::expected<PlayedRecording, Error> open(const ExportOptions& options) {
  auto reader = orError(kUnreadable, recording::RecordingReader::open(
                                         options.recording, recording::CutFiles::refused, options.limits));
  if (!reader) return tl::unexpected(reader.error());
  auto played = PlayedRecording::open(std::move(*reader));
  if (!played) return makeError(kUnreadable, "{}: {}", options.recording, played.error());
  return std::move(*played);
}

// Passes each requested frame to `take` and returns their number. Without a rate it passes all frames.
tl::expected<std::uint32_t, Error> forEachFrame(const ExportOptions& options, PlayedRecording& played,
                                                std::optional<double> rate, const TakeFrame& take) {
  const double length = static_cast<double>(played.reader().end() - played.reader().start()) * 1e-9;
  const double wanted = std::min(std::max(length - options.from, 0.0), options.seconds.value_or(length));
  const double shownRate = rate.value_or(cs_stream_rate(played.client()));
  Progress progress("export", 1 + static_cast<std::uint32_t>(std::min(wanted * shownRate, 1e9)));
  std::uint32_t frames = 0;
  double first = 0;
  for (;;) {
    if (interrupted()) return makeError(kNotWritten, "interrupted; {} was not written", options.out);
    const auto more = played.next();
    if (!more) return tl::unexpected(damageOf(played, options.recording, more.error()));
    if (!*more) break;
    const double now = played.seconds();
    if (now < options.from) continue;
    if (options.seconds && now >= options.from + *options.seconds) break;
    if (frames == 0) first = now;
    // Tolerates 1 ms, since the time of a frame is when it was recorded.
    if (rate && now - first + 0.001 < frames / *rate) continue;
    if (auto taken = take(played.client(), now - first); !taken) return tl::unexpected(taken.error());
    progress.show(++frames);
  }
  if (frames == 0) return makeError(kUnreadable, "{} has no frame in the requested time", options.recording);
  return frames;
}

tl::expected<std::uint32_t, Error> writeGltf(const ExportOptions& options) {
  auto played = open(options);
  if (!played) return tl::unexpected(played.error());
  const double rate = options.rate.value_or(kDefaultExportRate);
  GltfAnimation animation;
  auto frames = forEachFrame(options, *played, rate, [&](const cs_client* client, double seconds) -> Done {
    if (animation.frames() == kMaxGltfFrames)
      return makeError(
          kUsage,
          "the glTF would have more than {} frames; use a lower --rate, or a part of the recording with "
          "--from and --seconds",
          kMaxGltfFrames);
    animation.add(client, seconds);
    return {};
  });
  if (!frames) return frames;
  const bool text = std::filesystem::path(options.out).extension() == ".gltf";
  const std::string gltf = animation.finish(!text);
  if (gltf.empty())
    return makeError(
        kUsage, "{} would exceed 4 GiB, or {} morph targets of all parts of the cloths; export fewer frames",
        options.out, kMaxGltfTargets);
  auto file = orError(kNotWritten, recording::OutputFile::create(options.out));
  if (!file) return tl::unexpected(file.error());
  if (auto written = orError(kNotWritten, file->write(gltf)); !written) {
    std::filesystem::remove(options.out);
    return tl::unexpected(written.error());
  }
  return frames;
}

tl::expected<std::uint32_t, Error> writeNpz(const ExportOptions& options) {
  auto played = open(options);
  if (!played) return tl::unexpected(played.error());
  auto npz = NpzExport::begin(options.out, *played);
  if (!npz) return tl::unexpected(npz.error());
  auto frames = forEachFrame(options, *played, options.rate,
                             [&](const cs_client*, double) { return npz->add(*played); });
  if (!frames) return frames;
  if (auto written = npz->finish(); !written) return tl::unexpected(written.error());
  return frames;
}

tl::expected<std::uint32_t, Error> writeObjs(const ExportOptions& options) {
  auto played = open(options);
  if (!played) return tl::unexpected(played.error());
  std::error_code problem;
  if (!std::filesystem::create_directory(options.out, problem))
    return makeError(kNotWritten, "cannot create the directory {}: {}", options.out,
                     problem ? problem.message() : "it exists already");
  const double rate = options.rate.value_or(kDefaultExportRate);
  std::uint32_t next = 0;
  auto frames = forEachFrame(options, *played, rate, [&](const cs_client* client, double) -> Done {
    const auto path = std::filesystem::path(options.out) / fmt::format("frame_{:06}.obj", next++);
    auto file = orError(kNotWritten, files::NewFile::create(path.string()));
    if (!file) return tl::unexpected(file.error());
    return orError(kNotWritten, writeObj(client, *file));
  });
  if (!frames) std::filesystem::remove_all(options.out, problem);
  return frames;
}

}  // namespace

ExitCode exportFrames(const ExportOptions& options) {
  const std::filesystem::path extension = std::filesystem::path(options.out).extension();
  const bool gltf = extension == ".glb" || extension == ".gltf";
  if (std::filesystem::exists(options.out))
    return printError(Error{kNotWritten, fmt::format("cannot write {}: it exists already", options.out)});
  const auto frames = extension == ".npz" ? writeNpz(options)
                      : gltf              ? writeGltf(options)
                                          : writeObjs(options);
  if (!frames) return printError(frames.error());
  print("{}: {} frames\n", options.out, *frames);
  return kOk;
}

}  // namespace clothstream::cli
