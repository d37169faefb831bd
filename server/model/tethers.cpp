// SPDX-License-Identifier: MIT
// Runs Dijkstra's algorithm from all anchors at once until two groups of anchors have reached each node.
#include "server/model/tethers.h"

#include <functional>
#include <queue>
#include <tuple>

#include "server/model/springs.h"

namespace clothstream::model {
namespace {

// Springs that paths may follow: structural and shear.
std::vector<SpringLink> paths(const Cloth& cloth) {
  std::vector<SpringLink> links = springLinks(cloth);
  std::erase_if(links, [](const SpringLink& link) { return link.kind == SpringKind::bend; });
  return links;
}

std::uint32_t otherEnd(const SpringLink& link, std::uint32_t node) {
  return link.a == node ? link.b : link.a;
}

// Group of each anchor, identified by its first anchor. Tether::kNone for other nodes.
std::vector<std::uint32_t> groupsOf(const std::vector<std::uint8_t>& anchors,
                                    const std::vector<SpringLink>& links, const SpringAdjacency& adjacency) {
  std::vector<std::uint32_t> groups(anchors.size(), Tether::kNone);
  std::vector<std::uint32_t> reached;
  for (std::uint32_t first = 0; first < anchors.size(); ++first) {
    if (anchors[first] == 0 || groups[first] != Tether::kNone) continue;
    groups[first] = first;
    reached = {first};
    while (!reached.empty()) {
      const std::uint32_t node = reached.back();
      reached.pop_back();
      for (const std::uint32_t spring : adjacency.of(node)) {
        const std::uint32_t next = otherEnd(links[spring], node);
        if (anchors[next] == 0 || groups[next] != Tether::kNone) continue;
        groups[next] = first;
        reached.push_back(next);
      }
    }
  }
  return groups;
}

}  // namespace

std::vector<NodeTethers> nodeTethers(const Cloth& cloth) {
  const std::vector<SpringLink> links = paths(cloth);
  const SpringAdjacency adjacency = springAdjacency(links, cloth.nodeCount());
  const std::vector<std::uint8_t> anchors = pinnedNodes(cloth);
  const std::vector<std::uint32_t> groups = groupsOf(anchors, links, adjacency);

  // Distance, node, anchor. Equal distances are ordered by node and anchor, so that the result is
  // deterministic.
  using Step = std::tuple<double, std::uint32_t, std::uint32_t>;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> steps;
  for (std::uint32_t node = 0; node < anchors.size(); ++node)
    if (anchors[node] != 0) steps.emplace(0, node, node);
  std::vector<NodeTethers> tethers(cloth.nodeCount());
  while (!steps.empty()) {
    const auto [distance, node, anchor] = steps.top();
    steps.pop();
    if (anchors[node] == 0) {
      NodeTethers& found = tethers[node];
      if (found[1].anchor != Tether::kNone) continue;
      const bool isFirst = found[0].anchor == Tether::kNone;
      if (!isFirst && groups[found[0].anchor] == groups[anchor]) continue;
      found[isFirst ? 0 : 1] = {anchor, static_cast<float>(distance)};
    }
    for (const std::uint32_t spring : adjacency.of(node)) {
      const std::uint32_t next = otherEnd(links[spring], node);
      if (anchors[next] == 0 && tethers[next][1].anchor == Tether::kNone &&
          (anchors[node] == 0 || node == anchor))
        steps.emplace(distance + double{links[spring].restLength}, next, anchor);
    }
  }
  return tethers;
}

}  // namespace clothstream::model
