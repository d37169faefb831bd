// SPDX-License-Identifier: MIT
// Nodes as balls that keep out of each other, in double precision.
#include "server/reference/self_collision.h"

#include <algorithm>
#include <tuple>

namespace clothstream::reference {

SelfCollision::SelfCollision(const model::Scene& scene) {
  for (std::uint32_t cloth = 0; cloth < scene.cloths.size(); ++cloth) {
    const auto& collision = scene.cloths[cloth].selfCollision;
    for (const model::Vec3& rest : model::restPositions(scene.cloths[cloth])) {
      ball_.push_back(static_cast<std::uint32_t>(balls_.size()));
      if (collision)
        balls_.push_back({nodeCount_, cloth, collision->radius, collision->friction, rest.cast<double>()});
      ++nodeCount_;
    }
    if (collision) longest_ = std::max(longest_, 2 * double{collision->radius});
  }
}

std::vector<SelfCollision::Pair> SelfCollision::pairs(std::span<const Vec3> positions, double reach) const {
  // Along one axis only those need be looked at that are not too far apart on it.
  std::vector<std::uint32_t> order(balls_.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  Vec3 low = Vec3::Constant(1e30), high = -low;
  for (const Ball& ball : balls_) {
    low = low.cwiseMin(positions[ball.node]);
    high = high.cwiseMax(positions[ball.node]);
  }
  Eigen::Index axis = 0;
  (high - low).maxCoeff(&axis);
  const auto along = [&](std::uint32_t ball) { return positions[balls_[ball].node][axis]; };
  std::ranges::sort(order, {}, along);

  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < order.size(); ++i)
    for (std::size_t j = i + 1; j < order.size() && along(order[j]) - along(order[i]) < reach * longest_;
         ++j) {
      const auto [first, second] = std::minmax(order[i], order[j]);
      const Ball &a = balls_[first], &b = balls_[second];
      const double sum = a.radius + b.radius;
      if ((positions[a.node] - positions[b.node]).squaredNorm() >= reach * sum * reach * sum) continue;
      if (a.cloth == b.cloth && (a.rest - b.rest).norm() < double{model::kNeighbours} * sum) continue;
      pairs.push_back({a.node, b.node, sum});
    }
  std::ranges::sort(pairs, {}, [](const Pair& pair) { return std::tuple(pair.a, pair.b); });
  return pairs;
}

std::vector<std::uint8_t> SelfCollision::resolve(std::span<Vec3> positions, std::span<Vec3> velocities,
                                                 std::span<const double> inverseMasses, double h) const {
  const std::vector<Pair> touching = pairs(positions);
  std::vector<int> counts(nodeCount_, 0);
  for (const Pair& pair : touching) {
    ++counts[pair.a];
    ++counts[pair.b];
  }
  std::vector<Vec3> changes(nodeCount_, Vec3::Zero());
  for (const Pair& pair : touching) {
    const double wa = inverseMasses[pair.a], wb = inverseMasses[pair.b];
    const double shares = counts[pair.a] * wa + counts[pair.b] * wb;
    if (shares == 0) continue;
    const Vec3 apart = positions[pair.a] - positions[pair.b];
    const double length = apart.norm();
    const Vec3 normal = length < 1e-8 ? Vec3(-Vec3::UnitY()) : Vec3(apart / length);
    const Vec3 relative = velocities[pair.a] - velocities[pair.b];
    const double separation = relative.dot(normal);
    const double wanted = std::min(double{model::kOverlapCorrectionFraction} / h * (pair.distance - length),
                                   double{model::kPushOutSpeed});
    const double pressed = std::max(0.0, wanted - separation);
    const Vec3 slip = relative - separation * normal;
    const double friction = (balls_[ball_[pair.a]].friction + balls_[ball_[pair.b]].friction) / 2;
    const double speed = slip.norm();
    const double held = speed > 0 ? std::min(1.0, friction * pressed / speed) : 0;
    const Vec3 impulse = (pressed * normal - held * slip) / shares;
    changes[pair.a] += wa * impulse;
    changes[pair.b] -= wb * impulse;
  }
  std::vector<std::uint8_t> touched(nodeCount_, 0);
  for (std::uint32_t node = 0; node < nodeCount_; ++node) {
    velocities[node] += changes[node];
    positions[node] += h * changes[node];
    touched[node] = counts[node] > 0 ? 1 : 0;
  }
  return touched;
}

}  // namespace clothstream::reference
