// SPDX-License-Identifier: MIT
// Measures each frame when the next one is known, because velocities are central differences.
#include "clients/cli/cloth_measures.h"

#include <utility>

#include "clients/cli/progress.h"
#include "clients/cli/signals.h"
#include "clients/measure/energy.h"
#include "clients/measure/intersections.h"
#include "proto/codec/reach.h"

namespace clothstream::cli {
namespace {

struct Kept {
  double seconds = 0;
  std::vector<float> positions;
};

class Measurer {
 public:
  Measurer(const measure::Surface& surface, const MeasureSettings& settings)
      : settings_(settings), intersections_(surface.triangles) {
    for (std::size_t i = 0; i < surface.cloths.size(); ++i) {
      const measure::Cloth& cloth = surface.cloths[i];
      edges_.push_back(measure::structuralEdges(surface, cloth));
      masses_.push_back(measure::massesOf(surface, cloth, settings.arealMass[i]));
      ranges_.push_back({cloth.firstVertex, cloth.firstVertex + cloth.vertexCount});
    }
  }

  // Everything except the kinetic energy.
  FrameMeasures measure(const MotionFrame& frame, std::span<const measure::Solid> solids) {
    FrameMeasures measures{frame.tick, frame.seconds, codec::farthestOf(frame.positions),
                           std::vector<ClothMeasures>(ranges_.size())};
    std::vector<std::size_t> counts(ranges_.size(), 0);
    if (settings_.intersections) counts = intersections_.count(frame.positions, ranges_);
    for (std::size_t i = 0; i < ranges_.size(); ++i) {
      const measure::Intersections::Range& range = ranges_[i];
      ClothMeasures& cloth = measures.cloths[i];
      cloth.strain = measure::figuresOf(measure::strainsOf(edges_[i], frame.positions));
      cloth.penetration =
          measure::penetrationOf(solids, frame.positions, range.first, range.end - range.first);
      cloth.intersections = counts[i];
      cloth.gravity = measure::gravityEnergy(masses_[i], range.first, frame.positions, settings_.gravity);
    }
    return measures;
  }

  // Adds the kinetic energy, from the frames before and after.
  void addKinetic(FrameMeasures& measures, const Kept& before, const Kept& after) const {
    for (std::size_t i = 0; i < ranges_.size(); ++i)
      measures.cloths[i].kinetic = measure::kineticEnergy(masses_[i], ranges_[i].first, before.positions,
                                                          after.positions, after.seconds - before.seconds);
  }

 private:
  const MeasureSettings& settings_;
  measure::Intersections intersections_;
  std::vector<std::vector<measure::Edge>> edges_;  // by cloth, as are the next two
  std::vector<std::vector<double>> masses_;
  std::vector<measure::Intersections::Range> ranges_;
};

}  // namespace

tl::expected<void, Error> measureFrames(Motion& motion, const MeasureSettings& settings,
                                        const std::function<void(const FrameMeasures&)>& take) {
  Measurer measurer(motion.surface(), settings);
  Progress progress("measure",
                    static_cast<std::uint32_t>(std::min<std::uint64_t>(motion.frames(), UINT32_MAX)));
  Kept before, newest;
  std::optional<FrameMeasures> waiting;  // of `newest`
  for (std::uint32_t count = 0;; ++count) {
    if (interrupted()) return makeError(kFailed, "interrupted");
    progress.show(count);
    const auto more = motion.next();
    if (!more) return tl::unexpected(more.error());
    if (!*more) break;
    const MotionFrame& frame = motion.frame();
    Kept now{frame.seconds, {frame.positions.begin(), frame.positions.end()}};
    if (waiting) {
      if (!before.positions.empty()) measurer.addKinetic(*waiting, before, now);
      take(*waiting);
    }
    waiting = measurer.measure(frame, motion.solids());
    before = std::exchange(newest, std::move(now));
  }
  if (waiting) take(*waiting);
  return {};
}

}  // namespace clothstream::cli
