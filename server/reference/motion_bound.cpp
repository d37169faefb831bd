// SPDX-License-Identifier: MIT
// Bound on the motion of nodes that keeps cloth from passing through cloth, in double precision.
#include "server/reference/motion_bound.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <set>

#include "server/model/mesh.h"

namespace clothstream::reference {
namespace {

constexpr double kGap = 0.25;                // of the smallest radius
constexpr double kSlide = 0.4;               // of the gap, by which a correction may lengthen a motion
constexpr double kApproach = 0.1;            // of the gap, by which a pair that is too near separates
constexpr double kFloor = 0.1;               // of the gap, which no pair gives up
constexpr double kLeastShare = 1.0 / 65536;  // of a node in a pair's line that counts
constexpr double kUsed = 0.999;              // of a limit
constexpr double kCorrection = 0.05;         // m, the largest of a pair

Vec3 pointOf(const std::array<Vec3, 4>& corners, const std::array<double, 4>& weights, std::size_t first,
             std::size_t end) {
  Vec3 point = Vec3::Zero();
  for (std::size_t i = first; i < end; ++i) point += weights[i] * corners[i];
  return point;
}

ShortestLine lineWith(const std::array<Vec3, 4>& corners, const std::array<double, 4>& weights,
                      std::size_t second) {
  return {pointOf(corners, weights, 0, second) - pointOf(corners, weights, second, 4), weights};
}

double shareTowards(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double length = (b - a).squaredNorm();
  return length > 0 ? std::clamp((p - a).dot(b - a) / length, 0.0, 1.0) : 0;
}

void keepShorter(ShortestLine& best, const ShortestLine& other) {
  if (other.line.squaredNorm() < best.line.squaredNorm()) best = other;
}

}  // namespace

// The minimum of a convex function of two shares: inside the square or on one of its sides.
ShortestLine shortestBetweenEdges(const std::array<Vec3, 4>& c) {
  const auto at = [&](double s, double t) { return lineWith(c, {1 - s, s, 1 - t, t}, 2); };
  ShortestLine best = at(0, shareTowards(c[0], c[2], c[3]));
  keepShorter(best, at(1, shareTowards(c[1], c[2], c[3])));
  keepShorter(best, at(shareTowards(c[2], c[0], c[1]), 0));
  keepShorter(best, at(shareTowards(c[3], c[0], c[1]), 1));
  Eigen::Matrix<double, 3, 2> sides;
  sides << c[1] - c[0], c[2] - c[3];
  const Eigen::Vector2d inside = sides.colPivHouseholderQr().solve(c[2] - c[0]);
  if (inside.minCoeff() > 0 && inside.maxCoeff() < 1) keepShorter(best, at(inside[0], inside[1]));
  return best;
}

ShortestLine shortestToTriangle(const std::array<Vec3, 4>& c) {
  const auto at = [&](double b, double d) { return lineWith(c, {1, 1 - b - d, b, d}, 1); };
  ShortestLine best = at(shareTowards(c[0], c[1], c[2]), 0);
  keepShorter(best, at(0, shareTowards(c[0], c[1], c[3])));
  const double along = shareTowards(c[0], c[2], c[3]);
  keepShorter(best, at(1 - along, along));
  Eigen::Matrix<double, 3, 2> sides;
  sides << c[2] - c[1], c[3] - c[1];
  const Eigen::Vector2d inside = sides.colPivHouseholderQr().solve(c[0] - c[1]);
  if (inside.minCoeff() > 0 && inside.sum() < 1) keepShorter(best, at(inside[0], inside[1]));
  return best;
}

MotionBound::MotionBound(const model::Scene& scene) {
  std::uint32_t first = 0;
  std::vector<std::uint32_t> nodes;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::set<std::array<std::uint32_t, 2>> edges;
  for (const model::Cloth& cloth : scene.cloths) {
    if (model::boundsMotion(cloth)) {
      const double gap = kGap * double{cloth.selfCollision->radius};
      gap_ = gap_ == 0 ? gap : std::min(gap_, gap);
      for (std::uint32_t i = 0; i < cloth.nodeCount(); ++i) nodes.push_back(first + i);
      for (const model::Triangle& t : model::clothTriangles(cloth)) {
        triangles.push_back({first + t[0], first + t[1], first + t[2]});
        for (std::size_t k = 0; k < 3; ++k) {
          const auto [a, b] = std::minmax(t[k], t[(k + 1) % 3]);
          edges.insert({first + a, first + b});
        }
      }
    }
    first += cloth.nodeCount();
  }
  for (const std::uint32_t node : nodes)
    for (const auto& t : triangles)
      if (std::ranges::find(t, node) == t.end()) pairs_.push_back({{node, t[0], t[1], t[2]}, 1});
  for (auto one = edges.begin(); one != edges.end(); ++one)
    for (auto other = std::next(one); other != edges.end(); ++other)
      if (std::ranges::find_first_of(*one, *other) == one->end())
        pairs_.push_back({{(*one)[0], (*one)[1], (*other)[0], (*other)[1]}, 2});
}

ShortestLine MotionBound::lineOf(const Pair& pair, std::span<const Vec3> positions) const {
  const std::array<Vec3, 4> corners{positions[pair.nodes[0]], positions[pair.nodes[1]],
                                    positions[pair.nodes[2]], positions[pair.nodes[3]]};
  return pair.second == 1 ? shortestToTriangle(corners) : shortestBetweenEdges(corners);
}

// Lower bound of the distance: that of two spheres about the sets.
double MotionBound::leastDistance(const Pair& pair, std::span<const Vec3> positions) const {
  const auto middle = [&](std::size_t first, std::size_t end) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t k = first; k < end; ++k) sum += positions[pair.nodes[k]];
    return Vec3(sum / static_cast<double>(end - first));
  };
  const auto radius = [&](const Vec3& about, std::size_t first, std::size_t end) {
    double farthest = 0;
    for (std::size_t k = first; k < end; ++k)
      farthest = std::max(farthest, (positions[pair.nodes[k]] - about).norm());
    return farthest;
  };
  const Vec3 one = middle(0, pair.second), other = middle(pair.second, 4);
  return (one - other).norm() - radius(one, 0, pair.second) - radius(other, pair.second, 4);
}

void MotionBound::separate(std::span<const Pair> near, std::span<const Vec3> start, std::span<Vec3> positions,
                           std::span<Vec3> velocities, std::span<const double> inverseMasses,
                           double h) const {
  std::vector<Vec3> sums(positions.size(), Vec3::Zero());
  std::vector<double> totals(positions.size(), 0);
  for (const Pair& pair : near) {
    const ShortestLine shortest = lineOf(pair, start);
    const double distance = shortest.line.norm();
    if (distance <= 1e-6) continue;
    const Vec3 normal = shortest.line / distance;
    double apart = 0, give = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      const double side = k < pair.second ? 1 : -1;
      apart += side * shortest.weights[k] * normal.dot(positions[pair.nodes[k]]);
      give += shortest.weights[k] * shortest.weights[k] * inverseMasses[pair.nodes[k]];
    }
    const double lacking = std::min(std::min(distance + kApproach * gap_, gap_) - apart, kCorrection);
    if (lacking <= 0 || give <= 0) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      const double side = k < pair.second ? 1 : -1;
      const double along = side * shortest.weights[k] * inverseMasses[pair.nodes[k]] * lacking / give;
      const double share = std::abs(shortest.weights[k]);
      if (along == 0 || share < kLeastShare) continue;
      sums[pair.nodes[k]] += share * along * normal;
      totals[pair.nodes[k]] += share;
    }
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (totals[i] == 0) continue;
    const Vec3 way = positions[i] - start[i];
    Vec3 corrected = way + sums[i] / totals[i];
    const double longest = way.norm() + kSlide * gap_;
    if (corrected.norm() > longest) corrected *= longest / corrected.norm();
    positions[i] = start[i] + corrected;
    velocities[i] += (corrected - way) / h;
  }
}

void MotionBound::apply(std::span<const Vec3> start, std::span<Vec3> positions, std::span<Vec3> velocities,
                        std::span<const double> inverseMasses, double h) const {
  std::vector<Pair> near;
  for (const Pair& pair : pairs_) {
    double sides[2] = {0, 0};
    for (std::size_t k = 0; k < 4; ++k) {
      double& way = sides[k < pair.second ? 0 : 1];
      way = std::max(way, (positions[pair.nodes[k]] - start[pair.nodes[k]]).norm());
    }
    const double reach = sides[0] + sides[1] + gap_;
    if (leastDistance(pair, start) < reach && lineOf(pair, start).line.norm() < reach) near.push_back(pair);
  }
  separate(near, start, positions, velocities, inverseMasses, h);

  std::vector<double> shares(positions.size(), 1);
  for (const Pair& pair : near) {
    const ShortestLine shortest = lineOf(pair, start);
    const double distance = shortest.line.norm();
    if (distance <= 1e-6) continue;
    const Vec3 normal = shortest.line / distance;
    // Demand of each side: how far its foremost node passes the foremost place of its start.
    double front[2] = {-1e30, -1e30}, frontAfter[2] = {-1e30, -1e30};
    const auto towards = [&](std::size_t k, const Vec3& p) {
      return (k < pair.second ? -1 : 1) * normal.dot(p);
    };
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t side = k < pair.second ? 0 : 1;
      front[side] = std::max(front[side], towards(k, start[pair.nodes[k]]));
      frontAfter[side] = std::max(frontAfter[side], towards(k, positions[pair.nodes[k]]));
    }
    const double demand[2] = {std::max(frontAfter[0] - front[0], 0.0),
                              std::max(frontAfter[1] - front[1], 0.0)};
    const double free = std::max(-front[0] - front[1] - kFloor * gap_, 0.0);
    if (demand[0] + demand[1] <= free) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      const std::size_t side = k < pair.second ? 0 : 1;
      const double limit = front[side] + free * demand[side] / (demand[0] + demand[1]);
      const double from = towards(k, start[pair.nodes[k]]), to = towards(k, positions[pair.nodes[k]]);
      if (to <= limit) continue;
      double& share = shares[pair.nodes[k]];
      share = std::min(share, kUsed * std::max(limit - from, 0.0) / (to - from));
    }
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (shares[i] >= 1) continue;
    positions[i] = start[i] + shares[i] * (positions[i] - start[i]);
    if (inverseMasses[i] > 0) velocities[i] *= shares[i];
  }
}

}  // namespace clothstream::reference
