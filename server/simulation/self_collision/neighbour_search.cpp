// SPDX-License-Identifier: MIT
// Search on the device for nodes that may touch.
#include "server/simulation/self_collision/neighbour_search.h"

#include <algorithm>
#include <bit>

#include "kernels/count_cells.h"
#include "kernels/fill_cells.h"
#include "kernels/gather_neighbours.h"
#include "kernels/measure_velocities.h"
#include "kernels/sort_cells.h"
#include "kernels/start_cells.h"
#include "server/model/scene.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

// Work of a node (vulkan::Recorder::dispatch) when its neighbours are listed.
constexpr std::uint32_t kGatherWork = 8;
// The most of it: a search passes over kMaxInRow balls in each of nine rows, twice.
constexpr std::uint32_t kMostGatherWork = 2 * 9 * shared::kMaxInRow / 8;
// The most work of a ball when its cell is sorted.
constexpr std::uint32_t kMostSortWork = shared::kMaxInRow / 8;

// There are twice as many entries as nodes, so that cells that are not neighbours seldom share an entry.
std::uint32_t cellCountOf(std::uint32_t nodes) {
  return std::max(shared::kCellBlock, std::bit_ceil(2 * nodes));
}

std::size_t tableBytes(std::uint32_t cells) {
  return (std::size_t{cells} + cells / shared::kCellBlock + shared::kTableWords) * sizeof(std::uint32_t);
}

}  // namespace

NeighbourSearch::NeighbourSearch(const vulkan::Device& device, std::uint32_t nodeCount, const Buffer& rests,
                                 const StateBuffers& state, const Buffer& report, std::uint32_t workgroupSize)
    : nodeCount_(nodeCount),
      cellCount_(cellCountOf(nodeCount_)),
      table_(device, BufferPurpose::state, tableBytes(cellCount_)),
      starts_(device, BufferPurpose::state, (cellCount_ + 1) * sizeof(std::uint32_t)),
      entries_(device, BufferPurpose::state, nodeCount_ * sizeof(std::uint32_t)),
      order_(device, BufferPurpose::state, nodeCount_ * sizeof(std::uint32_t)),
      sorted_(device, BufferPurpose::texels, nodeCount_ * kTexelBytes),
      neighbours_(device, BufferPurpose::texels,
                  std::size_t{nodeCount_} * shared::kNeighbourStride * sizeof(float)),
      measure_(bindStates(device, {device, kernels::measure_velocities, workgroupSize},
                          [&](std::size_t of) {
                            return BufferList{&rests, state.velocities[of], &table_};
                          })),
      countCells_(bindStates(device, {device, kernels::count_cells, workgroupSize},
                             [&](std::size_t of) {
                               return BufferList{&rests, state.positions[of], &table_, &entries_};
                             })),
      startCells_(bindStates(device, {device, kernels::start_cells, workgroupSize},
                             [&](std::size_t) {
                               return BufferList{&table_, &starts_};
                             })),
      fillCells_(bindStates(device, {device, kernels::fill_cells, workgroupSize},
                            [&](std::size_t) {
                              return BufferList{&rests, &entries_, &table_, &order_};
                            })),
      sortCells_(bindStates(device, {device, kernels::sort_cells, workgroupSize},
                            [&](std::size_t of) {
                              return BufferList{state.positions[of], &entries_, &starts_, &order_, &sorted_};
                            })),
      gather_(bindStates(device, {device, kernels::gather_neighbours, workgroupSize}, [&](std::size_t of) {
        return BufferList{&state.cloths, &rests,   &sorted_,     state.velocities[of],
                          &table_,       &starts_, &neighbours_, &report};
      })) {}

void NeighbourSearch::record(vulkan::Recorder& recorder, std::uint32_t state, float aheadSeconds,
                             float reach) const {
  const shared::NeighbourPush push{.nodeCount = nodeCount_,
                                   .cellCount = cellCount_,
                                   .aheadSeconds = aheadSeconds,
                                   .reach = reach,
                                   .restFactor = model::kNeighbours};
  const auto dispatch = [&](const StateBindings& kernel, std::uint64_t invocations) {
    recorder.barrier();
    recorder.dispatch(kernel[state], push, invocations);
  };
  recorder.barrier();
  recorder.fill(table_, 0, table_.bytes());
  dispatch(measure_, (nodeCount_ + 63) / 64);
  dispatch(countCells_, nodeCount_);
  dispatch(startCells_, cellCount_ / shared::kCellBlock);
  dispatch(fillCells_, nodeCount_);
  recorder.barrier();
  recorder.dispatch(sortCells_[state], push, nodeCount_, 1, kMostSortWork);
  recorder.barrier();
  recorder.dispatch(gather_[state], push, nodeCount_, kGatherWork, kMostGatherWork);
}

}  // namespace clothstream::simulation
