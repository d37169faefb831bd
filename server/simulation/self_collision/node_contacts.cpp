// SPDX-License-Identifier: MIT
// Contacts of nodes on the device.
#include "server/simulation/self_collision/node_contacts.h"

#include "kernels/count_contacts.h"
#include "kernels/resolve_contacts.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using vulkan::Bindings;
using vulkan::BufferPurpose;

// Work of a node (vulkan::Recorder::dispatch) in a contact iteration.
constexpr std::uint32_t kContactWork = 4;

bool hasSeveralMaterials(std::span<const model::Cloth> cloths) {
  const model::SelfCollision* first = nullptr;
  for (const model::Cloth& cloth : cloths) {
    if (!cloth.selfCollision) continue;
    if (first == nullptr) first = &*cloth.selfCollision;
    if (first->radius != cloth.selfCollision->radius || first->friction != cloth.selfCollision->friction)
      return true;
  }
  return false;
}

}  // namespace

NodeContacts::NodeContacts(const vulkan::Device& device, std::uint32_t nodeCount, const Inputs& inputs,
                           const StateBuffers& state, std::uint32_t workgroupSize)
    : device_(device),
      inputs_(inputs),
      state_(state),
      workgroupSize_(workgroupSize),
      nodeCount_(nodeCount),
      positions_(device, BufferPurpose::texels, nodeCount_ * kTexelBytes),
      velocities_(device, BufferPurpose::texels, nodeCount_ * kTexelBytes),
      contacts_(device, BufferPurpose::texels,
                std::size_t{nodeCount_} * shared::kMaxContacts * sizeof(float)),
      touching_(device, BufferPurpose::state, nodeCount_ * sizeof(std::uint32_t)),
      groups_(device, BufferPurpose::indirect, sizeof(shared::ContactGroups)) {}

NodeContacts::Kernels::Kernels(const vulkan::Device& device, const NodeContacts& of, bool several)
    : count(bindStates(device, {device, kernels::count_contacts, of.workgroupSize_, {several ? 1u : 0u}},
                       [&](std::size_t at) {
                         return BufferList{&of.state_.cloths,
                                           &of.inputs_.rests,
                                           &of.inputs_.neighbours,
                                           of.state_.positions[at],
                                           of.state_.velocities[at],
                                           &of.positions_,
                                           &of.velocities_,
                                           &of.contacts_,
                                           &of.touching_,
                                           &of.groups_,
                                           &of.inputs_.report};
                       })),
      resolve(bindStates(device, {device, kernels::resolve_contacts, of.workgroupSize_, {several ? 1u : 0u}},
                         [&](std::size_t at) {
                           return BufferList{&of.state_.cloths,
                                             &of.inputs_.rests,
                                             &of.state_.colliders,
                                             &of.state_.nearColliders,
                                             &of.contacts_,
                                             &of.positions_,
                                             &of.velocities_,
                                             of.state_.positions[1 - at],
                                             &of.touching_,
                                             &of.groups_,
                                             of.state_.positions[at],
                                             of.state_.velocities[at],
                                             &of.state_.contactImpulses};
                         })) {}

void NodeContacts::setCloths(std::span<const model::Cloth> cloths) {
  several_ = hasSeveralMaterials(cloths) ? 1 : 0;
  std::unique_ptr<Kernels>& kernels = kernels_[several_];
  if (!kernels) kernels = std::make_unique<Kernels>(device_, *this, several_ == 1);
}

void NodeContacts::recordTables(vulkan::Recorder& recorder) const {
  recorder.fill(groups_, 1, groups_.bytes());
}

void NodeContacts::record(vulkan::Recorder& recorder, const Substep& substep) const {
  const std::uint32_t state = 1 - substep.from;
  const auto substepSeconds = static_cast<float>(substep.tick.substepSeconds);
  const shared::ContactPush push{.collision = substep.collision,
                                 .nodeCount = nodeCount_,
                                 .substepSeconds = substepSeconds,
                                 .correctionRate = model::kOverlapCorrectionFraction / substepSeconds,
                                 .pushOutSpeed = model::kPushOutSpeed};
  recorder.barrier();
  recorder.fill(groups_, 0, sizeof(std::uint32_t), offsetof(shared::ContactGroups, x));
  recorder.fill(groups_, 0, sizeof(std::uint32_t), offsetof(shared::ContactGroups, touching));
  recorder.barrier();
  recorder.dispatch(kernels_[several_]->count[state], push, nodeCount_, kContactWork);
  recorder.barrier();
  const Bindings& resolve = kernels_[several_]->resolve[state];
  const std::uint64_t work = std::uint64_t{kContactWork} * substep.collision.nodeWork;
  // Indirect dispatches cannot be divided.
  if (recorder.divides(resolve, nodeCount_, work))
    recorder.dispatch(resolve, push, nodeCount_, work);
  else
    recorder.dispatchIndirect(resolve, push, groups_, 0, nodeCount_ * work);
}

}  // namespace clothstream::simulation
