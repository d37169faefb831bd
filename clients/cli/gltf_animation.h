// SPDX-License-Identifier: MIT
// An animated mesh as a glTF 2.0 file, binary or text: a morph target a frame.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/core/core.h"

namespace clothstream::cli {

// Of one stream's frames, one after the other.
class GltfAnimation {
 public:
  // What the client shows now, so many seconds after the first; later from call to call.
  void add(const cs_client* client, double seconds);
  std::uint32_t frames() const { return static_cast<std::uint32_t>(seconds_.size()); }
  // At least one frame was added. Empty where the file would be larger than the format allows, 4 GiB.
  std::string toGlb() const;
  // The same as text, with the numbers in it as base64.
  std::string toGltf() const;

 private:
  struct Document {
    std::string json, numbers;
  };
  Document toDocument(bool embedded) const;

  struct Cloth {
    std::string name;
    std::uint32_t firstIndex = 0, indexCount = 0;
  };

  std::vector<Cloth> cloths_;
  std::vector<std::uint32_t> indices_;
  std::vector<float> positions_, normals_;  // of the first frame; after it what each differs by
  std::size_t numbers_ = 0;                 // of a frame
  std::vector<float> seconds_;
};

}  // namespace clothstream::cli
