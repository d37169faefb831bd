// SPDX-License-Identifier: MIT
// Descriptor sets of bindings, from pools that the whole device shares.
#include "server/vulkan/descriptor_pools.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <iterator>
#include <utility>

namespace clothstream::vulkan {
namespace {

constexpr std::uint32_t kFirstSets = 64, kMostSets = 4096;  // of a pool
// Descriptors of each kind in a pool, for each of its sets. Kernels have 6 bindings on
// average, and at most 15.
constexpr std::uint32_t kDescriptorsPerSet = 8;

constexpr BindingKind kBindingKinds[] = {BindingKind::storage, BindingKind::texels, BindingKind::images};
static_assert(std::size(kBindingKinds) == DescriptorCounts().size());

DescriptorCounts countsOf(std::span<const Binding> bindings) {
  DescriptorCounts counts{};
  for (const Binding& binding : bindings) ++counts[static_cast<std::size_t>(binding.kind)];
  return counts;
}

}  // namespace

vk::DescriptorType typeOf(BindingKind kind) {
  switch (kind) {
    case BindingKind::texels:
      return vk::DescriptorType::eUniformTexelBuffer;
    case BindingKind::images:
      return vk::DescriptorType::eStorageTexelBuffer;
    case BindingKind::storage:
      break;
  }
  return vk::DescriptorType::eStorageBuffer;
}

std::uint32_t DescriptorPools::count() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::uint32_t>(pools_.size());
}

DescriptorPools::Pool& DescriptorPools::addPool() {
  const std::uint32_t sets = pools_.empty() ? kFirstSets : std::min(kMostSets, 2 * pools_.back().sets);
  std::array<vk::DescriptorPoolSize, std::size(kBindingKinds)> sizes;
  Pool pool{.sets = sets, .freeSets = sets};
  for (std::size_t kind = 0; kind < sizes.size(); ++kind) {
    pool.free[kind] = sets * kDescriptorsPerSet;
    sizes[kind] = {.type = typeOf(kBindingKinds[kind]), .descriptorCount = pool.free[kind]};
  }
  pool.pool = vk::raii::DescriptorPool(
      device_, vk::DescriptorPoolCreateInfo{.flags = vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet,
                                            .maxSets = sets,
                                            .poolSizeCount = static_cast<std::uint32_t>(sizes.size()),
                                            .pPoolSizes = sizes.data()});
  return pools_.emplace_back(std::move(pool));
}

DescriptorPools::Taken DescriptorPools::takeFrom(Pool& pool, vk::DescriptorSetLayout layout,
                                                 const DescriptorCounts& needs) {
  vk::raii::DescriptorSets sets(
      device_, vk::DescriptorSetAllocateInfo{
                   .descriptorPool = *pool.pool, .descriptorSetCount = 1, .pSetLayouts = &layout});
  --pool.freeSets;
  for (std::size_t kind = 0; kind < needs.size(); ++kind) pool.free[kind] -= needs[kind];
  return {&pool, std::move(sets.front())};
}

DescriptorPools::Taken DescriptorPools::take(vk::DescriptorSetLayout layout, const DescriptorCounts& needs) {
  const std::lock_guard lock(mutex_);
  for (Pool& pool : pools_) {
    if (pool.freeSets == 0 || !std::ranges::equal(needs, pool.free, std::ranges::less_equal())) continue;
    try {
      return takeFrom(pool, layout, needs);
    } catch (const vk::FragmentedPoolError&) {
    } catch (const vk::OutOfPoolMemoryError&) {
    }
  }
  return takeFrom(addPool(), layout, needs);
}

void DescriptorPools::giveBack(Pool& pool, vk::raii::DescriptorSet& set, const DescriptorCounts& counts) {
  const std::lock_guard lock(mutex_);
  set.clear();
  ++pool.freeSets;
  for (std::size_t kind = 0; kind < counts.size(); ++kind) pool.free[kind] += counts[kind];
}

PooledSet::PooledSet(DescriptorPools& pools, vk::DescriptorSetLayout layout,
                     std::span<const Binding> bindings)
    : pools_(&pools), counts_(countsOf(bindings)) {
  DescriptorPools::Taken taken = pools.take(layout, counts_);
  pool_ = taken.pool;
  set_ = std::move(taken.set);
}

PooledSet::~PooledSet() {
  if (pool_ != nullptr) pools_->giveBack(*pool_, set_, counts_);
}

void PooledSet::swap(PooledSet& other) noexcept {
  std::swap(pools_, other.pools_);
  std::swap(pool_, other.pool_);
  std::swap(counts_, other.counts_);
  std::swap(set_, other.set_);
}

}  // namespace clothstream::vulkan
