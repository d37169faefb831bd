// SPDX-License-Identifier: MIT
// Colliders on the device: the upload in each tick, and the lists of colliders near the nodes.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/simulation/collision/collider_tables.h"
#include "server/simulation/collision/moving_collider.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// A kernel that includes shaders/collision/collide.glsl binds colliders() and nearLists(), and is pushed
// push().
class CollisionStage final : public Stage {
 public:
  // `positions` and `velocities` are the two state buffers of the scene: texels that outlive the stage.
  // `solids` has the meshes of all colliders and outlives the stage.
  CollisionStage(const vulkan::Device& device, const SolidTables& solids, std::uint32_t nodeCount,
                 std::uint32_t clothCount, std::array<const vulkan::Buffer*, 2> positions,
                 std::array<const vulkan::Buffer*, 2> velocities);

  // Uploads the colliders.
  void recordInputs(vulkan::Recorder& recorder, const Tick& tick) override;
  // Lists the colliders that nodes may touch within the tick. Stage "near".
  void recordStart(vulkan::Recorder& recorder, const Tick& tick, std::uint32_t present) override;
  // Copies the contacts to the CPU.
  void recordReport(vulkan::Recorder& recorder, const Tick& tick) override;

  // True if the tick has colliders that are not triangle meshes.
  bool active() const { return count_ > 0; }
  // Number of colliders that are triangle meshes. Their numbers on the device follow those of the others.
  std::uint32_t solidCount() const { return static_cast<std::uint32_t>(indices_.size()) - count_; }
  shared::CollisionPush push(std::uint32_t substep, std::uint32_t substeps, float tickRate) const;

  // Replaces `contacts` by those of the last recorded tick, which has this slot, once it is complete.
  void readContacts(std::uint32_t slot, std::vector<ContactStatus>& contacts) const;

  // Replaces `values` by those of the colliders of the last recorded tick, in the order of its inputs.
  // `numbers` has them as the device numbers colliders.
  void order(std::span<const float> numbers, std::vector<float>& values) const;

  const vulkan::Buffer& colliders() const { return colliders_; }
  const vulkan::Buffer& nearLists() const { return nearLists_; }
  const vulkan::Buffer& contactImpulses() const { return contactImpulses_; }

 private:
  std::size_t contactBytes() const {
    return reportsContacts_ ? indices_.size() * clothCount_ * sizeof(std::uint32_t) : 0;
  }

  const SolidTables& solidTables_;
  std::uint32_t nodeCount_, clothCount_;
  bool reportsContacts_ = false;
  std::uint32_t count_ = 0;                     // of colliders that are not triangle meshes
  std::vector<const MovingCollider*> ordered_;  // while inputs are recorded: as the device numbers them
  std::vector<std::uint32_t> indices_;          // of these colliders among the inputs of the tick
  std::uint32_t nodeWork_ = 1;
  ColliderTables tables_;
  vulkan::Buffer colliders_, bounds_, nearLists_, contactImpulses_;
  // By Tick::slot: a tick may be in flight while the next one is recorded.
  std::array<vulkan::Buffer, 2> uploads_;
  std::array<vulkan::Buffer, 2> contactReadbacks_;  // created when contacts are first reported
  const vulkan::Device& device_;
  StateBindings gather_;
};

}  // namespace clothstream::simulation
