// SPDX-License-Identifier: MIT
#include "clients/xr/render/frame_data.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>

#include "clients/xr/render/weave.h"

namespace clothstream::xr {
namespace {

// Rows of each ball of a capsule, and columns around it.
struct CapsuleMesh {
  std::uint32_t rows, columns;
};
constexpr CapsuleMesh kFine{14, 48}, kCoarse{5, 16};
constexpr float kFineRadius = 0.045F;  // m; larger capsules have the fine mesh

constexpr std::size_t kFirstParts = 16, kFirstSolids = 128, kFirstQuads = 40;

// Names: height, smallest height as an angle from the eye, and distances at which they have faded and begin
// to fade, m.
constexpr float kNameHeight = 0.075F, kNameAngle = 0.026F, kFadeTo = 0.3F, kFadeFrom = 0.6F;

shaders::vec4 widened(const Eigen::Vector3f& v, float w) {
  return {v.x(), v.y(), v.z(), w};
}

SolidClass classOf(const Solid& solid) {
  if (solid.hidesOnly) return SolidClass::kHides;
  return solid.opacity < 1 ? SolidClass::kFaint : SolidClass::kOpaque;
}

SolidMesh meshOf(const Solid& solid) {
  if (solid.kind == SolidKind::kBox) return SolidMesh::kBox;
  if (solid.kind == SolidKind::kPlane) return SolidMesh::kPlane;
  return std::max(solid.radius, solid.topRadius) >= kFineRadius ? SolidMesh::kFine : SolidMesh::kCoarse;
}

std::uint32_t kindOf(SolidMesh mesh) {
  switch (mesh) {
    case SolidMesh::kFine:
      return kFine.rows << 8 | kFine.columns << 16;
    case SolidMesh::kCoarse:
      return kCoarse.rows << 8 | kCoarse.columns << 16;
    case SolidMesh::kBox:
      return 1;
    case SolidMesh::kPlane:
      return 2;
  }
  return 0;
}

shaders::SolidRecord recordOf(const Solid& solid, SolidMesh mesh) {
  const Eigen::Vector3f shape = solid.kind == SolidKind::kCapsule
                                    ? Eigen::Vector3f(solid.radius, solid.topRadius, solid.length)
                                    : solid.size;
  const Eigen::Quaternionf& q = solid.pose.orientation;
  return {
      .position = widened(solid.pose.position, solid.hidesOnly ? -1 : solid.opacity),
      .orientation = {q.x(), q.y(), q.z(), q.w()},
      .shape = widened(shape, std::bit_cast<float>(kindOf(mesh))),
      .stretch = widened(solid.stretch, std::bit_cast<float>(static_cast<std::uint32_t>(solid.substance))),
      .colour = widened(solid.colour, solid.roughness),
      .more = {solid.reflection, 0, 0, 0}};
}

void addCapsule(const CapsuleMesh& mesh, std::vector<std::uint32_t>& out) {
  for (std::uint32_t row = 0; row < 2 * mesh.rows + 1; ++row) {
    for (std::uint32_t column = 0; column < mesh.columns; ++column) {
      const std::uint32_t next = (column + 1) % mesh.columns;
      const std::uint32_t below = row * mesh.columns, above = below + mesh.columns;
      for (const std::uint32_t index :
           {below + column, below + next, above + next, below + column, above + next, above + column})
        out.push_back(index);
    }
  }
}

Eigen::Vector3f eyeOf(const View& view) {
  return -view.view.block<3, 3>(0, 0).transpose() * view.view.block<3, 1>(0, 3);
}

}  // namespace

FrameData::FrameData(const GraphicsDevice& device, const Pipelines& pipelines, const Passes& passes,
                     const Textures& textures)
    : device_(device) {
  VkPhysicalDeviceProperties properties{};
  vkGetPhysicalDeviceProperties(device.physical, &properties);
  mostBytes_ = properties.limits.maxStorageBufferRange;
  const std::array<VkDescriptorPoolSize, 3> sizes{{
      {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, kFramesInFlight},
      {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, kFramesInFlight * 8},
      {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, kFramesInFlight * 6},
  }};
  VkDescriptorPoolCreateInfo poolInfo{};
  poolInfo.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  poolInfo.maxSets = kFramesInFlight;
  poolInfo.poolSizeCount = sizes.size();
  poolInfo.pPoolSizes = sizes.data();
  VkDescriptorPool pool = VK_NULL_HANDLE;
  check(vkCreateDescriptorPool(device.device, &poolInfo, nullptr, &pool), "vkCreateDescriptorPool");
  pool_ = {device.device, pool, vkDestroyDescriptorPool};
  makeSolidIndices();
  quads_.reserve(kFirstQuads);
  const VkDescriptorSetLayout layout = pipelines.setLayout();
  for (Slot& slot : slots_) {
    VkDescriptorSetAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    info.descriptorPool = pool;
    info.descriptorSetCount = 1;
    info.pSetLayouts = &layout;
    check(vkAllocateDescriptorSets(device.device, &info, &slot.set), "vkAllocateDescriptorSets");
    slot.frame =
        Buffer(device, sizeof(shaders::Frame), VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT, BufferAccess::kWritten);
    slot.staging =
        Buffer(device, Textures::stagingBytes(), VK_BUFFER_USAGE_TRANSFER_SRC_BIT, BufferAccess::kWritten);
    bindBuffer(slot, shaders::kFrameBinding, slot.frame.get());
    grow(slot, slot.parts, shaders::kPartsBinding, kFirstParts * sizeof(shaders::PartRecord));
    grow(slot, slot.solids, shaders::kSolidsBinding, kFirstSolids * sizeof(shaders::SolidRecord));
    grow(slot, slot.quads, shaders::kQuadsBinding, kFirstQuads * sizeof(shaders::QuadRecord));
    constexpr VkImageLayout kDepth = VK_IMAGE_LAYOUT_DEPTH_STENCIL_READ_ONLY_OPTIMAL;
    bindImage(slot, shaders::kShadowDepthsBinding, passes.shadowMap().view(), textures.texels(), kDepth);
    bindImage(slot, shaders::kShadowBinding, passes.shadowMap().view(), textures.compared(), kDepth);
    bindImage(slot, shaders::kWeaveColoursBinding, textures.weaveColours().view(), textures.tiled(),
              kSampled.layout);
    bindImage(slot, shaders::kWeaveReliefsBinding, textures.weaveReliefs().view(), textures.tiled(),
              kSampled.layout);
    bindImage(slot, shaders::kPanelBinding, textures.panel().view(), textures.clamped(), kSampled.layout);
    bindImage(slot, shaders::kLabelsBinding, textures.labels().view(), textures.clamped(), kSampled.layout);
  }
}

void FrameData::makeSolidIndices() {
  std::vector<std::uint32_t> indices;
  const auto add = [&](SolidMesh mesh, auto&& fill) {
    const auto first = static_cast<std::uint32_t>(indices.size());
    fill();
    solidIndexRanges_[static_cast<std::size_t>(mesh)] = {first,
                                                         static_cast<std::uint32_t>(indices.size()) - first};
  };
  const auto count = [&](std::uint32_t corners) {
    for (std::uint32_t i = 0; i < corners; ++i) indices.push_back(i);
  };
  add(SolidMesh::kFine, [&] { addCapsule(kFine, indices); });
  add(SolidMesh::kCoarse, [&] { addCapsule(kCoarse, indices); });
  add(SolidMesh::kBox, [&] { count(36); });
  add(SolidMesh::kPlane, [&] { count(6); });
  solidIndices_ = deviceBuffer(device_, indices.data(), indices.size() * sizeof(std::uint32_t),
                               VK_BUFFER_USAGE_INDEX_BUFFER_BIT);
}

void FrameData::bind(Slot& slot, std::uint32_t binding, const VkDescriptorBufferInfo* buffer,
                     const VkDescriptorImageInfo* image) const {
  VkWriteDescriptorSet write{};
  write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
  write.dstSet = slot.set;
  write.dstBinding = binding;
  write.descriptorCount = 1;
  write.descriptorType = descriptorType(binding);
  write.pBufferInfo = buffer;
  write.pImageInfo = image;
  vkUpdateDescriptorSets(device_.device, 1, &write, 0, nullptr);
}

void FrameData::bindBuffer(Slot& slot, std::uint32_t binding, VkBuffer buffer) const {
  const VkDescriptorBufferInfo info{buffer, 0, VK_WHOLE_SIZE};
  bind(slot, binding, &info, nullptr);
}

void FrameData::bindImage(Slot& slot, std::uint32_t binding, VkImageView view, VkSampler sampler,
                          VkImageLayout layout) const {
  const VkDescriptorImageInfo info{sampler, view, layout};
  bind(slot, binding, nullptr, &info);
}

void FrameData::grow(Slot& slot, Buffer& buffer, std::uint32_t binding, VkDeviceSize bytes) const {
  if (buffer.bytes() >= bytes) return;
  buffer = Buffer(device_, std::max(bytes, 2 * buffer.bytes()), VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                  BufferAccess::kWritten);
  bindBuffer(slot, binding, buffer.get());
}

void FrameData::upload(const Stage& stage) {
  const VkDeviceSize nodeBytes = std::max<VkDeviceSize>(16, VkDeviceSize{12} * stage.nodeCount);
  VkDeviceSize largest = nodeBytes;
  const auto measure = [&](const auto& list) {
    largest = std::max<VkDeviceSize>(largest, list.size() * sizeof(list[0]));
  };
  measure(stage.vertices);
  measure(stage.fanStarts);
  measure(stage.fans);
  if (largest > mostBytes_)
    throw std::runtime_error(fmt::format(
        "the scene is too large for the graphics device: a list of its {} vertices has {} bytes; a "
        "storage buffer has at most {}",
        stage.clothNodeCount, largest, mostBytes_));
  const auto copy = [&](const auto& list, VkBufferUsageFlags usage) {
    return deviceBuffer(device_, list.data(), list.size() * sizeof(list[0]), usage);
  };
  static_assert(sizeof(DrawnVertex) == sizeof(shaders::VertexRecord) && sizeof(Stage::Face) == 12);
  vertices_ = copy(stage.vertices, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
  indices_ = copy(stage.indices, VK_BUFFER_USAGE_INDEX_BUFFER_BIT);
  fanStarts_ = copy(stage.fanStarts, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
  fans_ = copy(stage.fans, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
  for (Slot& slot : slots_) {
    grow(slot, slot.positions, shaders::kPositionsBinding, nodeBytes);
    grow(slot, slot.normals, shaders::kNormalsBinding, nodeBytes);
    grow(slot, slot.parts, shaders::kPartsBinding, stage.parts.size() * sizeof(shaders::PartRecord));
    bindBuffer(slot, shaders::kVerticesBinding, vertices_.get());
    bindBuffer(slot, shaders::kFanStartsBinding, fanStarts_.get());
    bindBuffer(slot, shaders::kFansBinding, fans_.get());
  }
  topology_ = stage.topology;
}

VkDescriptorSet FrameData::write(const Stage& stage, std::span<const View> views,
                                 const shaders::Frame& frame) {
  slot_ = (slot_ + 1) % slots_.size();
  Slot& slot = slots_[slot_];
  shaders::Frame own = frame;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Matrix4f viewProjection = views[i].projection * views[i].view;
    own.viewProjection[i] = viewProjection;
    own.unproject[i] = viewProjection.inverse();
    own.eyes[i] = widened(eyeOf(views[i]), 0);
  }
  std::memcpy(slot.frame.data(), &own, sizeof(own));
  std::memcpy(slot.positions.data(), stage.positions.data(), stage.positions.size() * sizeof(float));
  if (!stage.normals.empty())
    std::memcpy(slot.normals.data(), stage.normals.data(), stage.normals.size() * sizeof(float));
  writeParts(stage, slot);
  writeSolids(stage, slot);
  return slot.set;
}

void FrameData::writeParts(const Stage& stage, Slot& slot) const {
  auto* out = static_cast<shaders::PartRecord*>(slot.parts.data());
  for (const MeshPart& part : stage.parts) {
    const Pose& pose = stage.frames[part.frame];
    const Surface& surface = part.surface;
    Eigen::Matrix4f model = Eigen::Matrix4f::Identity();
    model.block<3, 3>(0, 0) = pose.orientation.toRotationMatrix();
    model.block<3, 1>(0, 3) = pose.position;
    const float tiles =
        surface.woven ? 1 / (static_cast<float>(kThreads) * fabrics()[surface.weave].pitch) : 0.0F;
    const shaders::PartRecord record{
        .model = model,
        .colour = widened(surface.colour, surface.roughness),
        .sheen = {surface.sheen, surface.sheenRoughness, surface.reverse, surface.translucency},
        .look = {surface.relief, surface.reflection, tiles, static_cast<float>(surface.weave)},
        .faceted = surface.faceted ? 1U : 0U,
        .reserved0 = 0,
        .reserved1 = 0,
        .reserved2 = 0};
    std::memcpy(static_cast<void*>(out++), &record, sizeof(record));
  }
}

void FrameData::writeSolids(const Stage& stage, Slot& slot) {
  ranges_ = {};
  const auto rangeOf = [&](const Solid& solid) -> SolidRange& {
    return ranges_[static_cast<std::size_t>(classOf(solid))][static_cast<std::size_t>(meshOf(solid))];
  };
  const std::array<const std::vector<Solid>*, 2> lists{&stage.solids, &stage.own};
  for (const std::vector<Solid>* list : lists)
    for (const Solid& solid : *list) ++rangeOf(solid).count;
  std::uint32_t total = 0;
  for (auto& meshes : ranges_)
    for (SolidRange& range : meshes) {
      range.first = total;
      total += range.count;
      range.count = 0;
    }
  grow(slot, slot.solids, shaders::kSolidsBinding, total * sizeof(shaders::SolidRecord));
  auto* out = static_cast<shaders::SolidRecord*>(slot.solids.data());
  for (const std::vector<Solid>* list : lists)
    for (const Solid& solid : *list) {
      SolidRange& range = rangeOf(solid);
      const shaders::SolidRecord record = recordOf(solid, meshOf(solid));
      std::memcpy(static_cast<void*>(out + range.first + range.count++), &record, sizeof(record));
    }
}

std::uint32_t FrameData::writeQuads(const Stage& stage, std::span<const View> views,
                                    const Textures& textures) {
  Slot& slot = slots_[slot_];
  Eigen::Vector3f eye = Eigen::Vector3f::Zero();
  for (const View& view : views) eye += eyeOf(view) / static_cast<float>(views.size());
  quads_.clear();
  for (const Label& label : stage.labels) {
    const int layer = textures.layerOf(label);
    const Eigen::Vector3f away = label.position - eye;
    const float distance = away.norm();
    if (layer < 0 || distance <= kFadeTo) continue;
    // Both eyes see the name turned to the point between them, upright.
    Eigen::Vector3f right = away.cross(Eigen::Vector3f::UnitY());
    if (right.squaredNorm() < 1e-8F) continue;  // straight above or below
    right.normalize();
    const Eigen::Vector3f up = right.cross(away).normalized();
    const Picture& picture = *label.picture;
    const float half = 0.5F * std::max(kNameHeight, kNameAngle * distance);
    const float aspect = static_cast<float>(picture.width) / static_cast<float>(picture.height);
    const VkExtent2D texels = textures.labels().options().size;
    quads_.push_back(
        {.middle = widened(label.position, std::min(1.0F, (distance - kFadeTo) / (kFadeFrom - kFadeTo))),
         .right = widened(aspect * half * right,
                          static_cast<float>(picture.width) / static_cast<float>(texels.width)),
         .up = widened(half * up, static_cast<float>(picture.height) / static_cast<float>(texels.height)),
         .look = {static_cast<float>(layer), 0, 0, 0}});
  }
  const PanelQuad& panel = stage.panel;
  if (panel.visible && panel.picture != nullptr) {
    const auto part = [](std::uint32_t texels, std::uint32_t all) {
      return static_cast<float>(texels) / static_cast<float>(all);
    };
    const Eigen::Vector3f right = panel.pose.orientation * Eigen::Vector3f(0.5F * panel.size.x(), 0, 0);
    const Eigen::Vector3f up = panel.pose.orientation * Eigen::Vector3f(0, 0.5F * panel.size.y(), 0);
    quads_.push_back({.middle = widened(panel.pose.position, 1),
                      .right = widened(right, part(panel.picture->width, kPanelTexels[0])),
                      .up = widened(up, part(panel.picture->height, kPanelTexels[1])),
                      .look = {-1, 0, 0, 0}});
  }
  std::sort(quads_.begin(), quads_.end(), [&](const shaders::QuadRecord& a, const shaders::QuadRecord& b) {
    return (a.middle.head<3>() - eye).squaredNorm() > (b.middle.head<3>() - eye).squaredNorm();
  });
  grow(slot, slot.quads, shaders::kQuadsBinding, quads_.size() * sizeof(shaders::QuadRecord));
  std::memcpy(slot.quads.data(), quads_.data(), quads_.size() * sizeof(shaders::QuadRecord));
  return static_cast<std::uint32_t>(quads_.size());
}

}  // namespace clothstream::xr
