// SPDX-License-Identifier: MIT
// Tethers of a scene on the device.
#include "server/simulation/attachment/tether_table.h"

#include <cstddef>
#include <cstdint>
#include <utility>

namespace clothstream::simulation {

TetherTable::TetherTable(const vulkan::Device& device, std::vector<shared::TetherRecord> tethers)
    : table_(device, tethers), rest_(std::move(tethers)) {}

void TetherTable::setSlack(std::span<const model::Cloth> cloths) {
  if (empty()) return;
  std::vector<float> factors;
  for (const model::Cloth& cloth : cloths) factors.push_back(1 + (cloth.tethers ? cloth.tethers->slack : 0));
  if (factors == factors_) return;
  std::vector<shared::TetherRecord> tethers = rest_;
  std::size_t node = 0;
  for (std::size_t cloth = 0; cloth < cloths.size(); ++cloth)
    for (std::uint32_t i = 0; i < cloths[cloth].nodeCount(); ++i, ++node)
      for (shared::TetherEnd& end : tethers[node].ends) end.distance *= factors[cloth];
  table_.set(tethers);
  factors_ = std::move(factors);
  outdated_ = true;
}

void TetherTable::recordUpload(vulkan::Recorder& recorder) {
  if (std::exchange(outdated_, false)) table_.recordUpload(recorder);
}

}  // namespace clothstream::simulation
