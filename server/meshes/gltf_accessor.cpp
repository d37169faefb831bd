// SPDX-License-Identifier: MIT
#include "server/meshes/gltf_accessor.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <fmt/format.h>

#include "server/meshes/gltf_primitive.h"

namespace clothstream::meshes {

std::size_t componentsOf(const tinygltf::Accessor& accessor) {
  const int components = tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type));
  return components > 0 ? static_cast<std::size_t>(components) : 0;
}

tl::expected<GltfElements, std::string> elementsOf(const tinygltf::Model& model, int index, int type) {
  const tinygltf::Accessor* accessor = elementAt(model.accessors, index);
  if (!accessor) return tl::unexpected(fmt::format("accessor {} does not exist", index));
  const auto refuse = [&](std::string_view what) {
    return tl::unexpected(fmt::format("accessor {} {}", index, what));
  };
  if (accessor->sparse.isSparse)
    return refuse("is sparse, which is not supported: export it without sparse accessors");
  if (accessor->type != type) return refuse("has the wrong number of components");
  const tinygltf::BufferView* view = elementAt(model.bufferViews, accessor->bufferView);
  if (view && view->extensions.contains(kMeshoptExtension)) return tl::unexpected(meshoptError());
  const tinygltf::Buffer* buffer = view ? elementAt(model.buffers, view->buffer) : nullptr;
  if (!buffer) return refuse("has no buffer");
  const int stride = accessor->ByteStride(*view);
  const std::int64_t size =
      std::int64_t{tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(accessor->componentType))} *
      tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor->type));
  if (stride <= 0 || size <= 0) return refuse("has a component type or stride that glTF does not have");
  if (accessor->count == 0) return refuse("has no elements");
  const std::size_t bytes = buffer->data.size();
  const bool viewFits = view->byteOffset <= bytes && view->byteLength <= bytes - view->byteOffset;
  const bool startFits = viewFits && accessor->byteOffset <= view->byteLength;
  const std::size_t room = startFits ? view->byteLength - accessor->byteOffset : 0;
  const auto step = static_cast<std::size_t>(stride), last = static_cast<std::size_t>(size);
  if (last > room || accessor->count - 1 > (room - last) / step)
    return refuse(
        fmt::format("has {} elements, which its buffer of {} bytes does not hold", accessor->count, bytes));
  return GltfElements{buffer->data.data() + view->byteOffset + accessor->byteOffset, step, accessor->count,
                      accessor->componentType, accessor->normalized};
}

std::optional<float> component(const GltfElements& elements, std::size_t i, std::size_t c) {
  const auto number = [&]<typename T>(T value) {
    constexpr auto kMost = static_cast<float>(std::numeric_limits<T>::max());
    return elements.isNormalized ? std::max(static_cast<float>(value) / kMost, -1.0f)
                                 : static_cast<float>(value);
  };
  switch (elements.componentType) {
    case TINYGLTF_COMPONENT_TYPE_FLOAT:
      return elements.at<float>(i, c);
    case TINYGLTF_COMPONENT_TYPE_BYTE:
      return number(elements.at<std::int8_t>(i, c));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
      return number(elements.at<std::uint8_t>(i, c));
    case TINYGLTF_COMPONENT_TYPE_SHORT:
      return number(elements.at<std::int16_t>(i, c));
    case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
      return number(elements.at<std::uint16_t>(i, c));
    default:
      return std::nullopt;
  }
}

tl::expected<std::vector<float>, std::string> readFloats(const tinygltf::Model& model, int index, int type,
                                                         std::size_t most, std::string_view what) {
  const auto elements = elementsOf(model, index, type);
  if (!elements) return tl::unexpected(elements.error());
  if (elements->count > most)
    return tl::unexpected(
        fmt::format("has {} {}; at most {} are allowed: simplify it", elements->count, what, most));
  const auto components =
      static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type)));
  std::vector<float> numbers;
  numbers.reserve(components * elements->count);
  for (std::size_t i = 0; i < elements->count; ++i)
    for (std::size_t c = 0; c < components; ++c) {
      const std::optional<float> number = component(*elements, i, c);
      if (!number) return tl::unexpected(fmt::format("has {} of a type that glTF does not have", what));
      if (!std::isfinite(*number)) return tl::unexpected(fmt::format("has {} that are not finite", what));
      numbers.push_back(*number);
    }
  return numbers;
}

}  // namespace clothstream::meshes
