// SPDX-License-Identifier: MIT
// Animated mesh as a glTF 2.0 file, binary or text, with one morph target per frame.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <tiny_gltf.h>

#include "clients/cli/parts.h"
#include "clients/core/core.h"

namespace clothstream::cli {

// Largest number of frames times parts of cloths: each part names each morph target.
inline constexpr std::size_t kMaxGltfTargets = 1'000'000;

// Holds all frames in memory: 24 bytes a vertex and frame. Each part of a cloth is a primitive with a
// material of its name, and has the texture coordinates of the stream.
class GltfAnimation {
 public:
  // Adds the frame that the client shows now. `seconds` is the time since the first frame and must increase.
  void add(const cs_client* client, double seconds);
  std::uint32_t frames() const { return static_cast<std::uint32_t>(seconds_.size()); }
  // Content of the file: a GLB if `binary`, else JSON with the numbers as base64. Empty if the content would
  // exceed 4 GiB, or more than kMaxGltfTargets morph targets of all parts. Call it once, after the last
  // frame; at least one is needed.
  std::string finish(bool binary);

 private:
  using Attributes = std::map<std::string, int>;  // accessors by attribute

  // Each returns the number of the new accessor. `type` is the TINYGLTF_TYPE of an element.
  int addAccessor(std::span<const std::byte> bytes, int componentType, int type);
  int addFloats(std::span<const float> values, int type);
  int addBoundedFloats(std::span<const float> values, int type);
  void addAnimation(tinygltf::Mesh& mesh);
  void takeShape(const cs_client* client);
  void divideVertices(const cs_client* client, std::uint32_t index, const cs_cloth& cloth);
  std::vector<float> gathered(const float* vectors) const;
  int materialOf(const std::string& name);

  tinygltf::Model model_;
  std::vector<Part> parts_;
  std::vector<std::uint32_t> indices_;
  // Vertex of the client for each vertex of the file. A vertex of a client with several texture coordinates
  // is as many vertices of a file: the first has its own index, and the others follow all vertices.
  std::vector<std::uint32_t> sources_;
  std::vector<float> uvs_;  // two for each vertex of the file, v downwards; empty if no cloth has any
  std::vector<std::uint8_t> hasUvs_;        // of each cloth
  std::vector<float> positions_, normals_;  // of the first frame
  std::vector<Attributes> attributes_;      // per frame; after the first: the difference from it
  std::vector<float> seconds_;
  std::map<std::string, int> materials_;  // by name
};

}  // namespace clothstream::cli
