// SPDX-License-Identifier: MIT
// Motion of a recording, decoded frame by frame.
#include <utility>

#include <fmt/format.h>

#include "clients/cli/motion.h"
#include "clients/cli/recording_limits.h"
#include "clients/recording/played_recording.h"
#include "proto/recording/recorded_description.h"

namespace clothstream::cli {
namespace {

using client::PlayedRecording;

class RecordedMotion : public Motion {
 public:
  RecordedMotion(std::string path, PlayedRecording played, const v1::StreamDescription& description)
      : path_(std::move(path)),
        played_(std::move(played)),
        surface_(measure::surfaceOf(played_.client())),
        rate_(description.simulation_rate()),
        maxError_(double{description.max_error()}),
        definition_(description.definition()) {}

  tl::expected<bool, Error> next() override {
    const auto more = played_.next();
    if (!more) return tl::unexpected(damageOf(played_, path_, more.error()));
    if (!*more) return false;
    cs_statistics now;
    cs_get_statistics(played_.client(), 0, &now);
    frame_.tick = now.tick;
    frame_.seconds = static_cast<double>(now.tick) / rate_;
    frame_.positions = {cs_positions(played_.client()), surface_.rest.size()};
    return true;
  }
  const MotionFrame& frame() const override { return frame_; }
  std::vector<measure::Solid> solids() const override { return measure::solidsOf(played_.client()); }
  const measure::Surface& surface() const override { return surface_; }
  double rate() const override { return rate_; }
  std::uint64_t frames() const override {
    const auto& statistics = played_.reader().mcap().statistics();
    if (!statistics) return 0;
    for (const auto& [channel, count] : statistics->counts)
      if (played_.reader().topicOf(channel) == recording::Topic::frames) return count;
    return 0;
  }
  double maxError() const override { return maxError_; }
  std::optional<measure::Point> gravity() const override {
    if (!definition_.environment().has_gravity()) return std::nullopt;
    const v1::Vec3& gravity = definition_.environment().gravity();
    return measure::Point{double{gravity.x()}, double{gravity.y()}, double{gravity.z()}};
  }
  std::optional<double> massOf(std::size_t cloth) const override {
    if (cloth >= static_cast<std::size_t>(definition_.cloths_size())) return std::nullopt;
    const v1::Cloth& defined = definition_.cloths(static_cast<int>(cloth));
    if (!defined.has_mass()) return std::nullopt;
    return double{defined.mass()};
  }

 private:
  std::string path_;
  PlayedRecording played_;
  measure::Surface surface_;
  double rate_;
  double maxError_;
  v1::Scene definition_;
  MotionFrame frame_;
};

}  // namespace

tl::expected<std::unique_ptr<Motion>, Error> openRecordedMotion(const std::string& path,
                                                                const recording::ReadLimits& limits) {
  auto reader =
      orError(kUnreadable, recording::RecordingReader::open(path, recording::CutFiles::refused, limits));
  if (!reader) return tl::unexpected(reader.error());
  const auto description = orError(kUnreadable, recording::readDescription(*reader));
  if (!description) return tl::unexpected(description.error());
  if (description->simulation_rate() == 0)
    return makeError(kUnreadable, "{} is broken: its stream has no simulation rate", path);
  auto played = PlayedRecording::open(std::move(*reader));
  if (!played) return makeError(kUnreadable, "{}: {}", path, played.error());
  return std::make_unique<RecordedMotion>(path, std::move(*played), *description);
}

tl::expected<std::unique_ptr<Motion>, Error> openMotion(const std::string& path, const ArrayOptions& options,
                                                        const recording::ReadLimits& limits) {
  if (path.ends_with(".npz")) return openArrays(path, options, limits.vertices);
  if (!options.mesh.empty() || options.rate || options.first)
    return makeError(kUsage, "--mesh, --rate and --first-tick belong to .npz files; {} is a recording", path);
  return openRecordedMotion(path, limits);
}

}  // namespace clothstream::cli
