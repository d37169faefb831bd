// SPDX-License-Identifier: MIT
// Measures how well clothes stay on a figure that walks.
#include "tests/simulation/dressed.h"

#include <algorithm>
#include <variant>

#include <fmt/format.h>

#include "server/model/cloth_skin.h"
#include "server/reference/solid.h"
#include "tests/simulation/intersections.h"

namespace clothstream::tests {
namespace {

// Raises a worst value, and remembers its tick.
template <typename Value>
void raise(Value& worst, std::uint64_t& worstTick, Value value, std::uint64_t tick) {
  if (value <= worst) return;
  worst = value;
  worstTick = tick;
}

}  // namespace

Walk::Walk(const model::Scene& scene) : scene_(scene), running_(scene) {}

void Walk::on(std::uint64_t ticks, std::uint64_t every) {
  for (const std::uint64_t end = ticks_ + ticks; ticks_ < end; ++ticks_) {
    const simulation::TickInputs inputs = simulation::inputsAt(scene_, ticks_);
    for (const simulation::ClothReport& report : running_.tickAndReport(inputs)) {
      raise(wear_.depth, wear_.depthTick, double{report.penetration}, ticks_);
      raise(wear_.strain, wear_.strainTick, double{report.strainP99}, ticks_);
    }
    if (ticks_ % every == every - 1) measurePositions(inputs);
  }
}

void Walk::measurePositions(const simulation::TickInputs& inputs) {
  const std::vector<model::Vec3> positions = running_.state().positions;
  const simulation::MovingCollider& figure = inputs.colliders[0];
  std::size_t first = 0;
  for (const model::Cloth& cloth : scene_.cloths) {
    const std::vector<Eigen::Vector3d> places =
        model::skinnedPlaces(cloth, model::skinOf(scene_, cloth), figure.end, figure.jointsEnd);
    for (std::size_t node = 0; node < places.size(); ++node) {
      const double away = (positions[first + node].cast<double>() - places[node]).norm();
      const model::SkinLimits& limits = cloth.skin->limits[node];
      if (limits.followsExactly())
        wear_.astray = std::max(wear_.astray, away);
      else
        raise(wear_.excess, wear_.excessTick, away / limits.maxDistance - 1, ticks_);
    }
    first += places.size();
  }
  if (std::ranges::any_of(scene_.cloths,
                          [](const model::Cloth& cloth) { return cloth.selfCollision.has_value(); }))
    raise(wear_.crossings, wear_.crossingsTick, intersections(scene_, positions), ticks_);
}

double Walk::nearestExact() {
  const simulation::MovingCollider figure = simulation::inputsAt(scene_, ticks_ - 1).colliders[0];
  const model::ClosedMesh body =
      reference::moved(*std::get<model::Solid>(figure.shape), figure.jointsEnd, figure.jointsEnd, 1);
  const reference::Pose pose = reference::toPose(figure.end);
  const std::vector<model::Vec3> positions = running_.state().positions;
  double nearest = 1;
  std::size_t first = 0;
  for (const model::Cloth& cloth : scene_.cloths) {
    for (std::size_t node = 0; node < cloth.nodeCount(); ++node) {
      if (!cloth.skin->limits[node].followsExactly()) continue;
      const reference::Vec3 p =
          pose.orientation.conjugate() * (positions[first + node].cast<double>() - pose.position);
      nearest = std::min(nearest, reference::nearestOn(body, p).distance);
    }
    first += cloth.nodeCount();
  }
  return nearest;
}

std::string Walk::text() const {
  return fmt::format(
      "deepest {:.2f} mm in tick {}, p99 strain {:.2f} % in tick {}, {:.2f} % beyond the largest distance in "
      "tick {}, exact nodes {:.4f} mm astray, {} edges through triangles in tick {}",
      1e3 * wear_.depth, wear_.depthTick, 1e2 * wear_.strain, wear_.strainTick, 1e2 * wear_.excess,
      wear_.excessTick, 1e3 * wear_.astray, wear_.crossings, wear_.crossingsTick);
}

}  // namespace clothstream::tests
