// SPDX-License-Identifier: MIT
#include "server/model/skin_transfer.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <limits>
#include <numeric>

namespace clothstream::model {
namespace {

using Point = Eigen::Vector3d;

// Smallest weight that counts, relative to the largest one of the vertex. Devices may treat tiny numbers as
// 0.
constexpr double kLeastWeight = 1e-6;

// More than the rounding of a squared distance, so that the result does not depend on the order of the
// visits.
constexpr double kVisitSlack = 1 + 1e-12;

// Barycentric coordinates of a point of a triangle, and the squared distance of another point from it.
struct Nearest {
  std::array<double, 3> shares{1, 0, 0};
  double squaredDistance = std::numeric_limits<double>::infinity();
};

// Nearest point of the triangle a b c. Ericson, "Real-Time Collision Detection", 2005, 5.1.5.
Nearest nearestOn(const Point& a, const Point& b, const Point& c, const Point& p) {
  const Point ab = b - a, ac = c - a;
  const auto at = [&](double shareB, double shareC) {
    const Point place = a + shareB * ab + shareC * ac;
    return Nearest{{1 - shareB - shareC, shareB, shareC}, (p - place).squaredNorm()};
  };
  const double d1 = ab.dot(p - a), d2 = ac.dot(p - a);
  if (d1 <= 0 && d2 <= 0) return at(0, 0);
  const double d3 = ab.dot(p - b), d4 = ac.dot(p - b);
  if (d3 >= 0 && d4 <= d3) return at(1, 0);
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return at(d1 / (d1 - d3), 0);
  const double d5 = ab.dot(p - c), d6 = ac.dot(p - c);
  if (d6 >= 0 && d5 <= d6) return at(0, 1);
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return at(0, d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const double part = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return at(1 - part, part);
  }
  return at(vb / (va + vb + vc), vc / (va + vb + vc));
}

// Tree of boxes around the triangles, halved at the median of their middles along the longest side.
class TriangleTree {
 public:
  explicit TriangleTree(const ClosedMesh& mesh) : mesh_(mesh), order_(mesh.triangles.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    boxes_.reserve(2 * order_.size());
    addBox(0, static_cast<std::uint32_t>(order_.size()));
  }

  struct Found {
    std::uint32_t triangle = 0;
    Nearest nearest = {};
  };

  // `start` is any triangle. The nearer it is, the faster the search.
  Found find(const Point& point, std::uint32_t start) const {
    Found best{start, nearestOf(start, point)};
    std::array<std::uint32_t, kDeepest> open;
    std::size_t count = 0;
    open[count++] = 0;
    for (std::uint32_t visits = 0; count > 0 && visits < kMostTransferVisits; ++visits) {
      const std::uint32_t number = open[--count];
      const Box& box = boxes_[number];
      // A triangle at the same distance may have a lower number. Distances are rounded.
      if (squaredDistance(box, point) > kVisitSlack * best.nearest.squaredDistance) continue;
      if (box.second == 0) {
        for (std::uint32_t i = box.first; i < box.end; ++i) take(order_[i], point, best);
        continue;
      }
      const std::uint32_t left = number + 1;
      const bool leftFirst =
          squaredDistance(boxes_[left], point) <= squaredDistance(boxes_[box.second], point);
      open[count++] = leftFirst ? box.second : left;
      open[count++] = leftFirst ? left : box.second;
    }
    return best;
  }

 private:
  static constexpr std::uint32_t kLeaf = 4;  // triangles
  // Boxes that wait in a search: one for each level, and 20,000 triangles are halved 13 times to reach four.
  static constexpr std::size_t kDeepest = 32;

  // The first child follows its parent. A leaf has no second one.
  struct Box {
    Vec3 low, high;
    std::uint32_t first, end, second;
  };

  std::uint32_t addBox(std::uint32_t first, std::uint32_t end) {
    const auto number = static_cast<std::uint32_t>(boxes_.size());
    Box box{Vec3::Constant(std::numeric_limits<float>::max()),
            Vec3::Constant(-std::numeric_limits<float>::max()), first, end, 0};
    for (std::uint32_t i = first; i < end; ++i)
      for (const std::uint32_t corner : mesh_.triangles[order_[i]]) {
        box.low = box.low.cwiseMin(mesh_.vertices[corner]);
        box.high = box.high.cwiseMax(mesh_.vertices[corner]);
      }
    boxes_.push_back(box);
    if (end - first <= kLeaf) return number;
    Eigen::Index axis = 0;
    (box.high - box.low).maxCoeff(&axis);
    const auto middle = [&](std::uint32_t triangle) {
      double sum = 0;
      for (const std::uint32_t corner : mesh_.triangles[triangle])
        sum += double{mesh_.vertices[corner][axis]};
      return std::pair(sum, triangle);
    };
    const std::uint32_t half = first + (end - first) / 2;
    std::nth_element(order_.begin() + first, order_.begin() + half, order_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) { return middle(a) < middle(b); });
    addBox(first, half);
    boxes_[number].second = addBox(half, end);
    return number;
  }

  static double squaredDistance(const Box& box, const Point& point) {
    double sum = 0;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const double away =
          std::max({double{box.low[axis]} - point[axis], point[axis] - double{box.high[axis]}, 0.0});
      sum += away * away;
    }
    return sum;
  }

  Nearest nearestOf(std::uint32_t triangle, const Point& point) const {
    const auto& [a, b, c] = mesh_.triangles[triangle];
    return nearestOn(mesh_.vertices[a].cast<double>(), mesh_.vertices[b].cast<double>(),
                     mesh_.vertices[c].cast<double>(), point);
  }

  void take(std::uint32_t triangle, const Point& point, Found& best) const {
    const Nearest nearest = nearestOf(triangle, point);
    const bool isNearer =
        nearest.squaredDistance < best.nearest.squaredDistance ||
        (nearest.squaredDistance == best.nearest.squaredDistance && triangle < best.triangle);
    if (isNearer) best = {triangle, nearest};
  }

  const ClosedMesh& mesh_;
  std::vector<std::uint32_t> order_;  // triangles, by box
  std::vector<Box> boxes_;
};

VertexJoints meanOf(const ClosedMesh& mesh, const TriangleTree::Found& found) {
  std::vector<std::pair<std::uint8_t, double>> sums;
  sums.reserve(3 * kVertexJoints);
  for (std::size_t corner = 0; corner < 3; ++corner) {
    const VertexJoints& joints = mesh.skin->vertices[mesh.triangles[found.triangle][corner]];
    for (std::size_t k = 0; k < kVertexJoints; ++k) {
      const double weight = found.nearest.shares[corner] * double{joints.weights[k]};
      if (weight <= 0) continue;
      const auto same = std::ranges::find(sums, joints.joints[k], &std::pair<std::uint8_t, double>::first);
      if (same == sums.end())
        sums.emplace_back(joints.joints[k], weight);
      else
        same->second += weight;
    }
  }
  return largestJoints(std::move(sums));
}

}  // namespace

VertexJoints largestJoints(std::vector<std::pair<std::uint8_t, double>> weights) {
  assert(!weights.empty());
  std::ranges::sort(weights, [](const auto& a, const auto& b) {
    return a.second != b.second ? a.second > b.second : a.first < b.first;
  });
  const double least = kLeastWeight * weights.front().second;
  std::erase_if(weights, [&](const auto& joint) { return joint.second < least; });
  if (weights.size() > kVertexJoints) weights.resize(kVertexJoints);
  double sum = 0;
  for (const auto& [joint, weight] : weights) sum += weight;
  VertexJoints joints;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    joints.joints[k] = weights[k].first;
    joints.weights[k] = static_cast<float>(weights[k].second / sum);
  }
  return joints;
}

std::vector<VertexJoints> jointsNear(const ClosedMesh& mesh, std::span<const Vec3> points,
                                     const Cancellation& cancellation) {
  assert(mesh.skin);
  constexpr std::size_t kPointsBetweenChecks = 4096;
  const TriangleTree tree(mesh);
  std::vector<VertexJoints> joints;
  joints.reserve(points.size());
  TriangleTree::Found found;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i % kPointsBetweenChecks == 0) cancellation.check();
    // Points next to each other are often near the same triangle.
    found = tree.find(points[i].cast<double>(), found.triangle);
    joints.push_back(meanOf(mesh, found));
  }
  return joints;
}

}  // namespace clothstream::model
