// SPDX-License-Identifier: MIT
// Animated mesh as a glTF 2.0 file, binary or text, with one morph target per frame.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include <tiny_gltf.h>

#include "clients/core/core.h"

namespace clothstream::cli {

// Holds all frames in memory: 24 bytes a vertex and frame.
class GltfAnimation {
 public:
  // Adds the frame that the client shows now. `seconds` is the time since the first frame and must increase.
  void add(const cs_client* client, double seconds);
  std::uint32_t frames() const { return static_cast<std::uint32_t>(seconds_.size()); }
  // Content of the file: a GLB if `binary`, else JSON with the numbers as base64. Empty if the content would
  // exceed 4 GiB. Call it once, after the last frame; at least one is needed.
  std::string finish(bool binary);

 private:
  struct Cloth {
    std::string name;
    std::uint32_t firstIndex = 0, indexCount = 0;
  };
  using Attributes = std::map<std::string, int>;  // accessors by attribute

  // Each returns the number of the new accessor. `type` is the TINYGLTF_TYPE of an element.
  int addAccessor(std::span<const std::byte> bytes, int componentType, int type);
  int addFloats(std::span<const float> values, int type);
  int addBoundedFloats(std::span<const float> values, int type);
  void addAnimation(tinygltf::Mesh& mesh);

  tinygltf::Model model_;
  std::vector<Cloth> cloths_;
  std::vector<std::uint32_t> indices_;
  std::vector<float> positions_, normals_;  // of the first frame
  std::vector<Attributes> attributes_;      // per frame; after the first: the difference from it
  std::vector<float> seconds_;
};

}  // namespace clothstream::cli
