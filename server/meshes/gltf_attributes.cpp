// SPDX-License-Identifier: MIT
#include "server/meshes/gltf_attributes.h"

#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "server/meshes/gltf_accessor.h"

namespace clothstream::meshes {
namespace {

template <typename T>
using Expected = tl::expected<T, std::string>;

// Numbers of the attribute for each vertex, and how many of them are in use. Empty if the primitive does not
// have it.
struct AttributeNumbers {
  std::vector<Eigen::Vector4f> values;
  std::size_t components = 0;
};

Expected<AttributeNumbers> numbersOf(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                     const GltfPrimitive& read, const char* name) {
  const auto found = primitive.attributes.find(name);
  if (found == primitive.attributes.end()) return AttributeNumbers{};
  const auto refuse = [&](const std::string& text) {
    return tl::unexpected(fmt::format("{}: {}", name, text));
  };
  const tinygltf::Accessor* accessor = elementAt(model.accessors, found->second);
  if (!accessor) return refuse(fmt::format("accessor {} does not exist", found->second));
  const bool isColour = std::string_view(name) == kColours;
  AttributeNumbers numbers;
  numbers.components = componentsOf(*accessor);
  if (isColour ? numbers.components != 3 && numbers.components != 4 : numbers.components != 1)
    return refuse(fmt::format("has {} numbers for each vertex; must have {}", numbers.components,
                              isColour ? "3 or 4" : "1"));
  if (isColour && accessor->componentType != TINYGLTF_COMPONENT_TYPE_FLOAT && !accessor->normalized)
    return refuse(
        "has integers that are not normalised; export floats, or normalised unsigned bytes or shorts");
  if (const auto decoded = read.vectors.find(name); decoded != read.vectors.end()) {
    numbers.values = decoded->second;
    return numbers;
  }
  const auto elements = elementsOf(model, found->second, accessor->type);
  if (!elements) return refuse(elements.error());
  if (elements->count != read.positions.size())
    return refuse(fmt::format("has {} elements for {} vertices", elements->count, read.positions.size()));
  numbers.values.assign(elements->count, Eigen::Vector4f::Zero());
  for (std::size_t i = 0; i < elements->count; ++i)
    for (std::size_t c = 0; c < numbers.components; ++c) {
      const std::optional<float> number = component(*elements, i, c);
      if (!number) return refuse("has numbers of a type that is neither float, byte nor short");
      numbers.values[i][static_cast<Eigen::Index>(c)] = *number;
    }
  return numbers;
}

}  // namespace

Expected<void> addAttributes(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                             const GltfPrimitive& read, std::size_t before, VertexAttributes& attributes) {
  for (const auto& [name, list] : {std::pair(kMaxDistance, &attributes.maxDistances),
                                   std::pair(kBackstopDistance, &attributes.backstopDistances),
                                   std::pair(kBackstopRadius, &attributes.backstopRadii)}) {
    const auto numbers = numbersOf(model, primitive, read, name);
    if (!numbers) return tl::unexpected(numbers.error());
    if (numbers->components == 0) continue;
    list->resize(before, VertexAttributes::kAbsent);
    for (const Eigen::Vector4f& value : numbers->values) list->push_back(value.x());
  }
  const auto colours = numbersOf(model, primitive, read, kColours);
  if (!colours) return tl::unexpected(colours.error());
  if (colours->components == 0) return {};
  attributes.colours.resize(before, Eigen::Vector4f::Constant(VertexAttributes::kAbsent));
  for (Eigen::Vector4f colour : colours->values) {
    if (colours->components == 3) colour.w() = 1;
    attributes.colours.push_back(colour);
  }
  return {};
}

void completeAttributes(std::size_t vertices, VertexAttributes& attributes) {
  for (std::vector<float>* list :
       {&attributes.maxDistances, &attributes.backstopDistances, &attributes.backstopRadii})
    if (!list->empty()) list->resize(vertices, VertexAttributes::kAbsent);
  if (!attributes.colours.empty())
    attributes.colours.resize(vertices, Eigen::Vector4f::Constant(VertexAttributes::kAbsent));
}

}  // namespace clothstream::meshes
