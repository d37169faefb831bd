// SPDX-License-Identifier: MIT
// Tree of boxes over the triangles of the cloths, on the device.
#include "server/simulation/motion_bound/box_tree.h"

#include <cstddef>

#include "kernels/box_branches.h"
#include "kernels/box_faces.h"

namespace clothstream::simulation {

BoxTree::BoxTree(const vulkan::Device& device, const MotionBoundTables& tables, const vulkan::Buffer& faces,
                 const StateBuffers& state, std::uint32_t workgroupSize)
    : faceCount_(static_cast<std::uint32_t>(tables.faces.size())),
      levels_(tables.levels),
      branches_(device, tables.branches),
      boxes_(device, vulkan::BufferPurpose::state,
             std::size_t{tables.boxCount} * CLOTHSTREAM_TREE_BOX_TEXELS * sizeof(shared::vec4)),
      boxFaces_(
          bindStates(device, {device, kernels::box_faces, workgroupSize},
                     [&](std::size_t from) {
                       return BufferList{&faces, state.positions[from], state.positions[1 - from], &boxes_};
                     })),
      boxBranches_(device, {device, kernels::box_branches, workgroupSize}, {&branches_.texels(), &boxes_}) {}

void BoxTree::recordFit(vulkan::Recorder& recorder, std::uint32_t from, float gap) const {
  recorder.dispatch(boxFaces_[from], shared::TreePush{0, faceCount_, gap}, faceCount_);
  for (std::size_t level = 0; level + 1 < levels_.size(); ++level) {
    const std::uint32_t first = levels_[level], count = levels_[level + 1] - first;
    recorder.barrier();
    recorder.dispatch(boxBranches_, shared::TreePush{first, count, gap}, count);
  }
}

}  // namespace clothstream::simulation
