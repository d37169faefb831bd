// SPDX-License-Identifier: MIT
// A grid has a lattice of coarse nodes, with bilinear weights. A mesh has coarse nodes that are farthest from
// each other, with weights that fall with the distance along its springs.
#include "server/model/coarse_level.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>

#include "server/model/mesh.h"
#include "server/model/origin.h"
#include "server/model/springs.h"

namespace clothstream::model {
namespace {

using Share = CoarseLevel::Share;
using Link = CoarseLevel::Link;

Eigen::Vector3d meanOf(const std::vector<Share>& shares, const std::vector<Vec3>& positions) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Share& share : shares) mean += double{share.weight} * positions[share.node].cast<double>();
  return mean;
}

double sumOf(const std::vector<Share>& shares) {
  double sum = 0;
  for (const Share& share : shares) sum += double{share.weight};
  return sum;
}

void normalise(std::vector<Share>& shares) {
  const double sum = sumOf(shares);
  for (Share& share : shares) share.weight = static_cast<float>(share.weight / sum);
}

// ---- Grids

// Rows or columns with coarse nodes: every stride-th one, and the last.
std::vector<std::uint32_t> latticeOf(std::uint32_t count, std::uint32_t stride) {
  std::vector<std::uint32_t> at;
  for (std::uint32_t i = 0; i + 1 < count; i += stride) at.push_back(i);
  at.push_back(count - 1);
  return at;
}

struct Lattice {
  std::vector<std::uint32_t> rows, columns;
  std::uint32_t stride;

  std::uint32_t count() const { return static_cast<std::uint32_t>(rows.size() * columns.size()); }
  std::uint32_t number(std::size_t row, std::size_t column) const {
    return static_cast<std::uint32_t>(row * columns.size() + column);
  }
};

Lattice latticeOf(const Cloth& cloth, std::uint32_t cells) {
  const std::uint32_t longest = std::max(cloth.grid.rows, cloth.grid.columns) - 1;
  const std::uint32_t stride = std::max<std::uint32_t>(1, (longest + cells - 1) / cells);
  return {latticeOf(cloth.grid.rows, stride), latticeOf(cloth.grid.columns, stride), stride};
}

// The pinned node that a coarse node at (row, column) stands for: the nearest one within half a stride.
std::optional<std::uint32_t> pinNear(const Grid& grid, const std::vector<std::uint8_t>& pinned,
                                     std::uint32_t row, std::uint32_t column, std::uint32_t stride) {
  const std::uint32_t reach = (stride - 1) / 2;
  std::optional<std::uint32_t> nearest;
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max();
  for (std::uint32_t r = row - std::min(row, reach); r <= std::min(row + reach, grid.rows - 1); ++r)
    for (std::uint32_t c = column - std::min(column, reach); c <= std::min(column + reach, grid.columns - 1);
         ++c) {
      const std::uint32_t node = r * grid.columns + c;
      const std::uint64_t down = r < row ? row - r : r - row, across = c < column ? column - c : c - column;
      const std::uint64_t square = down * down + across * across;
      if (pinned[node] == 0 || square >= least) continue;
      least = square;
      nearest = node;
    }
  return nearest;
}

// Rows or columns around the k-th one with coarse nodes. Their weights fall to 0 at its neighbours.
std::vector<Share> hatOf(const std::vector<std::uint32_t>& lines, std::size_t k) {
  const std::uint32_t centre = lines[k];
  std::vector<Share> hat{{centre, 1}};
  const auto add = [&](std::uint32_t from, std::uint32_t to) {
    for (std::uint32_t line = std::min(from, to) + 1; line < std::max(from, to); ++line)
      hat.push_back({line, static_cast<float>(line < centre ? line - from : to - line) /
                               static_cast<float>(to - from)});
  };
  if (k > 0) add(lines[k - 1], centre);
  if (k + 1 < lines.size()) add(centre, lines[k + 1]);
  return hat;
}

// Part of a correction that the first of two coarse nodes takes. A fixed one takes nothing.
float partOf(double mass, bool fixed, double otherMass, bool otherFixed) {
  if (fixed || otherFixed) return fixed ? 0.0f : 1.0f;
  return static_cast<float>(otherMass / (mass + otherMass));
}

CoarseLevel gridLevel(const Cloth& cloth, std::uint32_t cells) {
  const Grid& grid = cloth.grid;
  const Lattice lattice = latticeOf(cloth, cells);
  const std::vector<std::uint8_t> pinned = pinnedNodes(cloth);
  const std::vector<Vec3> rest = restPositions(cloth, originOf(cloth));
  CoarseLevel level;
  level.lattice = {static_cast<std::uint32_t>(lattice.rows.size()),
                   static_cast<std::uint32_t>(lattice.columns.size()), lattice.stride};
  std::vector<Eigen::Vector3d> means;
  std::vector<double> masses;
  for (std::size_t r = 0; r < lattice.rows.size(); ++r)
    for (std::size_t c = 0; c < lattice.columns.size(); ++c) {
      std::vector<Share> mean;
      for (const Share& row : hatOf(lattice.rows, r))
        for (const Share& column : hatOf(lattice.columns, c))
          mean.push_back({row.node * grid.columns + column.node, row.weight * column.weight});
      masses.push_back(sumOf(mean));
      normalise(mean);
      const auto pin = pinNear(grid, pinned, lattice.rows[r], lattice.columns[c], lattice.stride);
      level.fixed.push_back(pin ? 1 : 0);
      level.means.push_back(pin ? std::vector<Share>{{*pin, 1}} : std::vector<Share>());
      means.push_back(meanOf(pin ? level.means.back() : mean, rest));
    }

  // Along rows, along columns, and both diagonals; each in two colours.
  constexpr std::array<std::array<int, 2>, 4> kSteps{{{0, 1}, {1, 0}, {1, 1}, {1, -1}}};
  const auto rows = static_cast<int>(lattice.rows.size()), columns = static_cast<int>(lattice.columns.size());
  for (const auto& [down, across] : kSteps)
    for (int parity = 0; parity < 2; ++parity) {
      std::vector<Link>& colour = level.colours.emplace_back();
      for (int row = 0; row + down < rows; ++row)
        for (int column = 0; column < columns; ++column) {
          const int other = column + across;
          if (((down == 0 ? column : row) & 1) != parity || other < 0 || other >= columns) continue;
          const std::uint32_t a =
              lattice.number(static_cast<std::size_t>(row), static_cast<std::size_t>(column));
          const std::uint32_t b =
              lattice.number(static_cast<std::size_t>(row + down), static_cast<std::size_t>(other));
          if (level.fixed[a] == 0 || level.fixed[b] == 0)
            colour.push_back({a, b, static_cast<float>((means[b] - means[a]).norm()),
                              partOf(masses[a], level.fixed[a] != 0, masses[b], level.fixed[b] != 0)});
        }
    }
  std::erase_if(level.colours, [](const std::vector<Link>& colour) { return colour.empty(); });
  return level;
}

// ---- Meshes

// Distances along structural and shear springs at rest.
class Distances {
 public:
  explicit Distances(const Cloth& cloth)
      : links_(withoutBend(springLinks(cloth))), adjacency_(springAdjacency(links_, cloth.nodeCount())) {}

  // Lowers `distances` to those from `start` where these are smaller and at most `limit`. Calls `lowered`
  // with each such node.
  template <typename Lowered>
  void from(std::uint32_t start, double limit, std::vector<double>& distances, const Lowered& lowered) const {
    using Step = std::pair<double, std::uint32_t>;
    std::priority_queue<Step, std::vector<Step>, std::greater<>> steps;
    const auto reach = [&](double distance, std::uint32_t node) {
      if (distance > limit || distance >= distances[node]) return;
      distances[node] = distance;
      lowered(node);
      steps.emplace(distance, node);
    };
    reach(0, start);
    while (!steps.empty()) {
      const auto [distance, node] = steps.top();
      steps.pop();
      if (distance > distances[node]) continue;
      for (const std::uint32_t spring : adjacency_.of(node)) {
        const SpringLink& link = links_[spring];
        reach(distance + double{link.restLength}, link.a == node ? link.b : link.a);
      }
    }
  }

  const std::vector<SpringLink>& links() const { return links_; }

 private:
  static std::vector<SpringLink> withoutBend(std::vector<SpringLink> links) {
    std::erase_if(links, [](const SpringLink& link) { return link.kind == SpringKind::bend; });
    return links;
  }

  std::vector<SpringLink> links_;
  SpringAdjacency adjacency_;
};

struct Centres {
  std::vector<std::uint32_t> nodes;
  std::vector<std::uint32_t> nearest;  // centre of each node
  double radius = 0;                   // largest distance of a node from its centre, m
};

// Each centre is the node that is farthest from the earlier ones; the first is a pinned node if there is one.
Centres centresOf(const Distances& distances, const std::vector<std::uint8_t>& pinned, std::size_t wanted) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  std::vector<double> toNearest(pinned.size(), kFar);
  Centres centres;
  centres.nearest.resize(pinned.size());
  const auto add = [&](std::uint32_t node) {
    const auto number = static_cast<std::uint32_t>(centres.nodes.size());
    centres.nodes.push_back(node);
    distances.from(node, kFar, toNearest, [&](std::uint32_t lowered) { centres.nearest[lowered] = number; });
  };
  const auto pin = std::find(pinned.begin(), pinned.end(), 1);
  add(pin == pinned.end() ? 0 : static_cast<std::uint32_t>(pin - pinned.begin()));
  while (centres.nodes.size() < std::min(wanted, pinned.size())) {
    const auto farthest = std::max_element(toNearest.begin(), toNearest.end());
    if (*farthest == 0) break;
    add(static_cast<std::uint32_t>(farthest - toNearest.begin()));
  }
  centres.radius = *std::max_element(toNearest.begin(), toNearest.end());
  return centres;
}

CoarseLevel meshLevel(const Cloth& cloth, std::uint32_t cells) {
  const Distances distances(cloth);
  const std::vector<std::uint8_t> pinned = pinnedNodes(cloth);
  const std::vector<Vec3> rest = restPositions(cloth, originOf(cloth));
  const std::size_t side = cells + 1;
  const Centres centres =
      centresOf(distances, pinned, std::min<std::size_t>(side * side, (pinned.size() + 3) / 4));
  const std::size_t count = centres.nodes.size();
  // Centres whose areas share a spring are at most this far apart, plus that spring.
  const double reach = 2 * centres.radius;
  double longestSpring = 0;
  for (const SpringLink& link : distances.links())
    longestSpring = std::max(longestSpring, double{link.restLength});

  // Weights fall linearly with the distance from a centre. A node keeps its four largest.
  CoarseLevel level;
  level.shares.assign(pinned.size(), {});
  std::map<std::pair<std::uint32_t, std::uint32_t>, double> between;  // distances of centres
  for (std::uint32_t k = 0; k < count; ++k) {
    std::vector<double> fromCentre(pinned.size(), std::numeric_limits<double>::infinity());
    distances.from(centres.nodes[k], reach + longestSpring, fromCentre, [](std::uint32_t) {});
    for (std::uint32_t node = 0; node < pinned.size(); ++node) {
      const double weight = reach > 0 ? 1 - fromCentre[node] / reach : (fromCentre[node] == 0 ? 1 : 0);
      auto& shares = level.shares[node];
      auto* const least = std::min_element(
          shares.begin(), shares.end(), [](const Share& a, const Share& b) { return a.weight < b.weight; });
      if (weight > least->weight) *least = {k, static_cast<float>(weight)};
    }
    for (std::uint32_t other = k + 1; other < count; ++other)
      between[{k, other}] = fromCentre[centres.nodes[other]];
  }
  level.means.resize(count);
  std::vector<double> masses(count);
  for (std::uint32_t node = 0; node < pinned.size(); ++node) {
    auto& shares = level.shares[node];
    float sum = 0;
    for (const Share& share : shares) sum += share.weight;
    for (Share& share : shares) {
      share.weight /= sum;
      if (share.weight == 0) continue;
      const double mass = double{share.weight} * cloth.mesh->shares[node];
      masses[share.node] += mass;
      level.means[share.node].push_back({node, static_cast<float>(mass)});
    }
  }

  // A pinned node near a centre stands for it.
  level.fixed.assign(count, 0);
  std::vector<Eigen::Vector3d> means;
  for (std::uint32_t k = 0; k < count; ++k) {
    std::vector<double> near(pinned.size(), std::numeric_limits<double>::infinity());
    std::optional<std::uint32_t> pin;
    distances.from(centres.nodes[k], centres.radius / 2, near, [&](std::uint32_t node) {
      if (pinned[node] != 0 && (!pin || near[node] < near[*pin])) pin = node;
    });
    if (pin) level.means[k] = {{*pin, 1}};
    level.fixed[k] = pin ? 1 : 0;
    normalise(level.means[k]);
    means.push_back(meanOf(level.means[k], rest));
  }

  // Centres are linked if nodes of both meet at a spring. A curved cloth may unfold, so that the distance
  // along it bounds that of the means.
  std::map<std::pair<std::uint32_t, std::uint32_t>, float> links;
  for (const SpringLink& spring : distances.links()) {
    const auto [a, b] = std::minmax(centres.nearest[spring.a], centres.nearest[spring.b]);
    if (a == b || (level.fixed[a] != 0 && level.fixed[b] != 0)) continue;
    const double straight = (rest[centres.nodes[b]] - rest[centres.nodes[a]]).cast<double>().norm();
    const double along = between.at({a, b});
    const double unfolded = straight > 0 ? std::max(1.0, along / straight) : 1.0;
    links[{a, b}] = static_cast<float>((means[b] - means[a]).norm() * unfolded);
  }
  std::vector<std::vector<std::uint8_t>> used;  // coarse nodes of each colour
  for (const auto& [ends, longest] : links) {
    const auto [a, b] = ends;
    std::size_t colour = 0;
    while (colour < used.size() && (used[colour][a] != 0 || used[colour][b] != 0)) ++colour;
    if (colour == used.size()) {
      used.emplace_back(count);
      level.colours.emplace_back();
    }
    used[colour][a] = used[colour][b] = 1;
    level.colours[colour].push_back(
        {a, b, longest, partOf(masses[a], level.fixed[a] != 0, masses[b], level.fixed[b] != 0)});
  }
  return level;
}

}  // namespace

std::vector<CoarseLevel> coarseLevels(const Cloth& cloth) {
  const std::uint32_t cells = cloth.coarse->cells;
  const auto level = [&](std::uint32_t n) { return cloth.mesh ? meshLevel(cloth, n) : gridLevel(cloth, n); };
  std::vector<CoarseLevel> levels;
  if (cloth.coarse->levels > 1) levels.push_back(level(std::max(2u, cells / 4)));
  levels.push_back(level(cells));
  return levels;
}

float leastCoarseDamping(const Cloth& cloth, double h) {
  return static_cast<float>(double{kCoarseDamping} * double{cloth.nodeMass()} / h);
}

}  // namespace clothstream::model
