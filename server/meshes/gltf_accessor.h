// SPDX-License-Identifier: MIT
// Numbers of the accessors of a glTF file.
#pragma once

#include <cstddef>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tiny_gltf.h>
#include <tl/expected.hpp>

namespace clothstream::meshes {

// Elements of an accessor in its buffer. The bounds are checked.
struct GltfElements {
  const unsigned char* first = nullptr;
  std::size_t stride = 0, count = 0;
  int componentType = 0;
  bool isNormalized = false;

  template <typename T>
  T at(std::size_t index, std::size_t component) const {
    T value;
    std::memcpy(&value, first + index * stride + component * sizeof(T), sizeof(T));
    return value;
  }
};

// Numbers of an element.
std::size_t componentsOf(const tinygltf::Accessor& accessor);

// `type` is the TINYGLTF_TYPE of an element. Allocates nothing but the text of an error.
[[nodiscard]] tl::expected<GltfElements, std::string> elementsOf(const tinygltf::Model& model, int index,
                                                                 int type);

// Component of an element as a float. Integers are normalised where the accessor says so. Nothing if the type
// of the components is not one of a vertex.
std::optional<float> component(const GltfElements& elements, std::size_t i, std::size_t c);

// All numbers of an accessor as floats. Refuses more than `most` elements, and numbers that are not finite.
// `what` names the elements for an error.
[[nodiscard]] tl::expected<std::vector<float>, std::string> readFloats(const tinygltf::Model& model,
                                                                       int index, int type, std::size_t most,
                                                                       std::string_view what);

}  // namespace clothstream::meshes
