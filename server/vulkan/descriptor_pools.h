// SPDX-License-Identifier: MIT
// Descriptor sets of bindings, from pools that the whole device shares.
#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <mutex>
#include <span>

#include <vulkan/vulkan_raii.hpp>

#include "server/vulkan/spirv_interface.h"

namespace clothstream::vulkan {

vk::DescriptorType typeOf(BindingKind kind);

// Number of descriptors, by BindingKind.
using DescriptorCounts = std::array<std::uint32_t, 3>;

// The first pool has room for 64 sets, and each further pool for twice as many as the one before, up to
// 4,096. Pools stay until this is destroyed; their sets are freed one by one. Thread-safe.
class DescriptorPools {
 public:
  // `device` must outlive this, and this all sets.
  explicit DescriptorPools(const vk::raii::Device& device) : device_(device) {}

  std::uint32_t count() const;

 private:
  friend class PooledSet;
  struct Pool {
    vk::raii::DescriptorPool pool = nullptr;
    std::uint32_t sets = 0, freeSets = 0;
    DescriptorCounts free{};
  };
  struct Taken {
    Pool* pool;
    vk::raii::DescriptorSet set;
  };
  Taken take(vk::DescriptorSetLayout layout, const DescriptorCounts& needs);
  void giveBack(Pool& pool, vk::raii::DescriptorSet& set, const DescriptorCounts& counts);

  // These need the mutex.
  Pool& addPool();
  Taken takeFrom(Pool& pool, vk::DescriptorSetLayout layout, const DescriptorCounts& needs);

  const vk::raii::Device& device_;
  mutable std::mutex mutex_;  // protects the next one, and the pools in it
  std::list<Pool> pools_;     // oldest first
};

// A descriptor set, which goes back to its pool. Move-only.
class PooledSet {
 public:
  PooledSet() = default;  // no set
  // A set with this layout, which has one descriptor for each binding. Throws vk::SystemError.
  PooledSet(DescriptorPools& pools, vk::DescriptorSetLayout layout, std::span<const Binding> bindings);
  ~PooledSet();
  PooledSet(PooledSet&& other) noexcept { swap(other); }
  PooledSet& operator=(PooledSet&& other) noexcept {
    swap(other);
    return *this;
  }

  const vk::DescriptorSet& operator*() const { return *set_; }

 private:
  void swap(PooledSet& other) noexcept;

  DescriptorPools* pools_ = nullptr;
  DescriptorPools::Pool* pool_ = nullptr;
  DescriptorCounts counts_{};
  vk::raii::DescriptorSet set_ = nullptr;
};

}  // namespace clothstream::vulkan
