// SPDX-License-Identifier: MIT
#include "server/meshes/placement.h"

#include <optional>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace clothstream::meshes {
namespace {

using model::Vec3;
using Point = Eigen::Vector3d;

// Positions of vertices: scaled by `scale` about `middle`, then posed.
struct Placing {
  Eigen::Matrix3d rotation;
  Point origin, middle;
  double scale;

  Vec3 operator()(const Vec3& vertex) const {
    return (origin + rotation * (scale * (vertex.cast<double>() - middle))).cast<float>();
  }
};

struct Box {
  Point low, high;

  explicit Box(const std::vector<Vec3>& vertices)
      : low(vertices.front().cast<double>()), high(vertices.front().cast<double>()) {
    for (const Vec3& vertex : vertices) {
      low = low.cwiseMin(vertex.cast<double>());
      high = high.cwiseMax(vertex.cast<double>());
    }
  }
  Point size() const { return high - low; }
};

// Mean length of the sides of all faces, in units of the source.
double meanEdge(const MeshSource& source) {
  double sum = 0, count = 0;
  for (const SourceFace& face : source.faces)
    for (std::uint32_t i = 0; i < face.cornerCount; ++i) {
      const Vec3& a = source.vertices[source.cornerOf(face, i).vertex];
      const Vec3& b = source.vertices[source.cornerOf(face, (i + 1) % face.cornerCount).vertex];
      sum += (a.cast<double>() - b.cast<double>()).norm();
      ++count;
    }
  return count > 0 ? sum / count : 0;
}

// First vertex that is farther from the origin than the limit.
std::optional<std::size_t> firstOutside(const std::vector<Vec3>& vertices, const Placing& placing,
                                        float limit) {
  for (std::size_t i = 0; i < vertices.size(); ++i)
    if (!(placing(vertices[i]).cwiseAbs().maxCoeff() <= limit)) return i;
  return std::nullopt;
}

std::string shownSize(const Point& size) {
  return fmt::format("{:.4g} x {:.4g} x {:.4g} m", size.x(), size.y(), size.z());
}

class Placement {
 public:
  Placement(const MeshSource& source, const MeshOptions& options, const MeshLimits& limits)
      : source_(source),
        limits_(limits),
        placing_{options.pose.orientation.cast<double>().toRotationMatrix(),
                 options.pose.position.cast<double>(), Point::Zero(), double{options.scale}},
        box_(source.vertices),
        meanEdge_(meanEdge(source)) {}

  // Returns an error text if the mesh does not fit the world.
  std::optional<std::string> check(std::string_view remedy) const {
    if (isTooFine())
      return fmt::format(
          "has edges with a mean length of {:.3g} m after scaling; at least {:g} m is needed: {}",
          meanEdge_ * placing_.scale, limits_.minEdge, remedy);
    if (const auto i = firstOutside(source_.vertices, placing_, limits_.maxCoordinate))
      return fmt::format(
          "vertex {} is at {} m after scaling, and the mesh is {} large; each coordinate must be within {:g} "
          "m of "
          "the origin: {}",
          *i, shownPoint(placing_(source_.vertices[*i])), shownSize(box_.size() * placing_.scale),
          limits_.maxCoordinate, remedy);
    return std::nullopt;
  }

  std::string remedy() const {
    return fmt::format(
        "set the scale (0.01 for centimetres), move it, or set \"fit\", which {}",
        keepsScale() ? "moves its middle to its pose" : fmt::format("makes it {:g} m large", kFittedSize));
  }

  void fit(Repairs& repairs) {
    const double before = placing_.scale;
    repairs.sizeBefore = (box_.size() * before).cast<float>();
    if (!keepsScale() && box_.size().maxCoeff() > 0) placing_.scale = kFittedSize / box_.size().maxCoeff();
    placing_.middle = (box_.low + box_.high) / 2;
    repairs.sizeAfter = (box_.size() * placing_.scale).cast<float>();
    repairs.fittedScale = placing_.scale / before;
  }

  std::vector<Vec3> positions() const {
    const bool isSame = placing_.rotation.isIdentity(0) && placing_.origin.isZero(0) &&
                        placing_.middle.isZero(0) && placing_.scale == 1;
    if (isSame) return source_.vertices;
    std::vector<Vec3> placed;
    placed.reserve(source_.vertices.size());
    for (const Vec3& vertex : source_.vertices) placed.push_back(placing_(vertex));
    return placed;
  }

 private:
  // Every mesh without an edge that is too short passes, whatever the rounding.
  bool isTooFine() const { return meanEdge_ * placing_.scale < 0.999 * double{limits_.minEdge}; }
  bool keepsScale() const {
    return !isTooFine() && box_.size().maxCoeff() * placing_.scale <= double{limits_.maxCoordinate};
  }

  const MeshSource& source_;
  const MeshLimits& limits_;
  Placing placing_;
  Box box_;
  double meanEdge_;
};

}  // namespace

std::string shownPoint(const Vec3& p) {
  return fmt::format("({:g}, {:g}, {:g})", p.x(), p.y(), p.z());
}

tl::expected<std::vector<Vec3>, std::string> place(const MeshSource& source, const MeshOptions& options,
                                                   const MeshLimits& limits, Repairs& repairs) {
  Placement placement(source, options, limits);
  auto problem = placement.check(placement.remedy());
  if (problem && options.fit) {
    placement.fit(repairs);
    problem = placement.check("move it, or simplify it");
  }
  if (problem) return tl::unexpected(std::move(*problem));
  return placement.positions();
}

}  // namespace clothstream::meshes
