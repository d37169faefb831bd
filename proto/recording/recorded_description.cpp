// SPDX-License-Identifier: MIT
#include "proto/recording/recorded_description.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

namespace clothstream::recording {
namespace {

static_assert(v1::Frame::kPacketFieldNumber == kFramePacket);
static_assert(v1::Frame::kReconstructionHashFieldNumber == kFrameReconstructionHash);
static_assert(std::endian::native == std::endian::little);

template <typename Number>
std::vector<Number> numbersOf(const std::string& bytes) {
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
  return numbers;
}

// Numbers that are too large for the layout become invalid ones.
std::uint8_t small(std::uint32_t number) {
  return static_cast<std::uint8_t>(std::min(number, 255u));
}

}  // namespace

tl::expected<v1::StreamDescription, std::string> readDescription(RecordingReader& reader) {
  const auto bytes = reader.description();
  if (!bytes) return tl::unexpected(bytes.error());
  v1::StreamDescription description;
  if (!description.ParseFromString(*bytes))
    return tl::unexpected(std::string("the description of its stream is invalid"));
  if (const std::string problem = sizeProblemOf(description, reader.limits()); !problem.empty())
    return tl::unexpected("the description of its stream has " + problem);
  return description;
}

std::string sizeProblemOf(const v1::StreamDescription& description, const ReadLimits& limits) {
  std::uint64_t vertices = 0, triangles = 0;
  for (const v1::ClothDescription& cloth : description.cloths()) {
    vertices += cloth.vertex_count();
    triangles += cloth.triangles().size() / (3 * sizeof(std::uint32_t));
  }
  return limits.problemOf(vertices, triangles);
}

codec::StreamLayout layoutOf(const v1::StreamDescription& description) {
  codec::StreamLayout layout{
      .epoch = description.epoch(),
      .codec = small(description.codec()),
      .maxError = description.max_error(),
      .normals = description.normals() == v1::NORMALS_OCTAHEDRAL ? codec::NormalMode::octahedral
                                                                 : codec::NormalMode::none,
      .qualities = small(std::max(description.qualities(), 1u)),
      .cloths = {},
      .origin = {description.origin().x(), description.origin().y(), description.origin().z()}};
  for (const v1::ClothDescription& cloth : description.cloths()) {
    codec::ClothLayout& made = layout.cloths.emplace_back();
    made = {cloth.vertex_count(), cloth.rows(), cloth.columns(), numbersOf<std::uint32_t>(cloth.triangles())};
    // The decoder reads rest positions of meshes only.
    if (!made.triangles.empty()) made.restPositions = numbersOf<float>(cloth.rest_positions());
  }
  return layout;
}

}  // namespace clothstream::recording
