// SPDX-License-Identifier: MIT
#include "server/meshes/triangulation.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>

namespace clothstream::meshes {
namespace {

using model::Triangle;
using model::Vec3;
using PlanePoint = Eigen::Vector2d;

// Ratio of doubled area to squared longest side below which a triangle counts as flat, as in isFlat().
constexpr double kFlat = 1e-5;
// Distance from the border of an ear, in terms of the same ratio, within which a corner counts as inside.
constexpr double kOnBorder = 1e-6;

double cross(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

double longestSquared(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  return std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
}

// Doubled area over the square of the longest side: 0.87 for an equilateral triangle, negative if it is
// clockwise.
double shapeOf(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  const double longest = longestSquared(a, b, c);
  return longest > 0 ? cross(a, b, c) / longest : 0;
}

// Projects the corners along the axis of the largest component of the polygon's normal (Newell's method). The
// result is counter-clockwise.
std::vector<PlanePoint> projected(std::span<const Vec3> corners) {
  const Eigen::Vector3d origin = corners[0].cast<double>();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector3d a = corners[i].cast<double>() - origin;
    normal += a.cross(corners[(i + 1) % corners.size()].cast<double>() - origin);
  }
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  const Eigen::Index u = (axis + 1) % 3, v = (axis + 2) % 3;
  const double sign = normal[axis] < 0 ? -1 : 1;
  std::vector<PlanePoint> points;
  points.reserve(corners.size());
  for (const Vec3& corner : corners)
    points.emplace_back(double{corner[u]} - origin[u], sign * (double{corner[v]} - origin[v]));
  return points;
}

// Whether every corner is convex and the polygon goes around once.
bool isConvex(const std::vector<PlanePoint>& p) {
  const std::size_t n = p.size();
  for (std::size_t i = 0; i < n; ++i)
    if (shapeOf(p[i], p[(i + 1) % n], p[(i + 2) % n]) <= kFlat) return false;
  for (std::size_t i = 2; i < n; ++i) {
    if (cross(p[0], p[1], p[i]) <= 0) return false;
    if (i + 1 < n && cross(p[0], p[i], p[i + 1]) <= 0) return false;
  }
  return true;
}

std::vector<Triangle> strip(std::uint32_t count) {
  std::vector<Triangle> triangles;
  std::uint32_t low = 0, high = count - 1;
  for (bool fromLow = true; high - low >= 2; fromLow = !fromLow) {
    triangles.push_back(fromLow ? Triangle{low, low + 1, high} : Triangle{low, high - 1, high});
    fromLow ? ++low : --high;
  }
  return triangles;
}

// The remaining polygon is a ring of corners. An ear is a convex corner whose triangle contains no other
// corner that is not convex. Clipping only removes obstacles, so the search of an ear continues where it has
// stopped until the ear itself changes. The time is thus in proportion to the square of the corners.
class EarClipper {
 public:
  explicit EarClipper(const std::vector<PlanePoint>& points) : p_(points), ears_(points.size()) {
    const auto n = static_cast<std::uint32_t>(points.size());
    for (std::uint32_t i = 0; i < n; ++i) ears_[i] = {.previous = (i + n - 1) % n, .next = (i + 1) % n};
    for (std::uint32_t i = 0; i < n; ++i) {
      classify(i);
      if (ears_[i].shape <= kFlat) obstacles_.push_back(i);
    }
  }

  std::vector<Triangle> clip() {
    std::vector<Triangle> triangles;
    std::uint32_t first = 0;
    for (std::size_t left = ears_.size(); left > 3; --left) {
      const std::uint32_t ear = best(first);
      Ear& clipped = ears_[ear];
      triangles.push_back({clipped.previous, ear, clipped.next});
      clipped.isClipped = true;
      ears_[clipped.previous].next = clipped.next;
      ears_[clipped.next].previous = clipped.previous;
      classify(clipped.previous);
      classify(clipped.next);
      if (first == ear) first = clipped.next;
    }
    triangles.push_back({ears_[first].previous, first, ears_[first].next});
    return triangles;
  }

 private:
  struct Ear {
    std::uint32_t previous = 0, next = 0;
    double shape = 0;
    std::size_t searched = 0;  // obstacles that are known to be outside
    bool isClipped = false;
  };

  void classify(std::uint32_t i) {
    ears_[i].shape = shapeOf(p_[ears_[i].previous], p_[i], p_[ears_[i].next]);
    ears_[i].searched = 0;
  }

  bool isObstacle(std::uint32_t i) const { return !ears_[i].isClipped && ears_[i].shape <= kFlat; }

  bool contains(std::uint32_t ear, std::uint32_t corner) const {
    const PlanePoint &a = p_[ears_[ear].previous], &b = p_[ear], &c = p_[ears_[ear].next], &q = p_[corner];
    if (q == a || q == b || q == c) return false;
    const double border = -kOnBorder * longestSquared(a, b, c);
    return cross(a, b, q) >= border && cross(b, c, q) >= border && cross(c, a, q) >= border;
  }

  bool isFree(std::uint32_t ear) {
    std::size_t& at = ears_[ear].searched;
    while (at < obstacles_.size() && !(isObstacle(obstacles_[at]) && contains(ear, obstacles_[at]))) ++at;
    return at == obstacles_.size();
  }

  // Ear with the best shape. A polygon that crosses itself may have none: then the corner with the best
  // shape.
  std::uint32_t best(std::uint32_t first) {
    std::uint32_t ear = first, other = first;
    double shape = kFlat;
    std::uint32_t i = first;
    do {
      if (ears_[i].shape > shape && isFree(i)) ear = i, shape = ears_[i].shape;
      if (ears_[i].shape > ears_[other].shape) other = i;
      i = ears_[i].next;
    } while (i != first);
    return shape > kFlat ? ear : other;
  }

  const std::vector<PlanePoint>& p_;
  std::vector<Ear> ears_;
  std::vector<std::uint32_t> obstacles_;
};

}  // namespace

bool isFlat(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return double{(b - a).cross(c - a).norm()} < kFlat * longest;
}

std::vector<Triangle> triangulate(std::span<const Vec3> corners) {
  if (corners.size() == 3) return {{0, 1, 2}};
  const std::vector<PlanePoint> points = projected(corners);
  if (isConvex(points)) return strip(static_cast<std::uint32_t>(points.size()));
  if (points.size() > kMaxConcaveCorners) return {};
  return EarClipper(points).clip();
}

}  // namespace clothstream::meshes
