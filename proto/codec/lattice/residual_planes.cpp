// SPDX-License-Identifier: MIT
// Residuals as planes of bytes.
#include "proto/codec/lattice/residual_planes.h"

namespace clothstream::codec {

std::uint32_t splitPlanes(const std::int32_t* residuals, std::size_t count,
                          const std::array<std::byte*, kMaxPlanes>& planes, std::size_t offset) {
  std::uint32_t used = 0;
  for (std::size_t i = 0; i < count; ++i) used |= zigzag(residuals[i]);
  const std::size_t needed = planeCount(used);
  for (std::size_t p = 0; p < kMaxPlanes; ++p) {
    std::byte* plane = planes[p] + offset;
    // Another channel may need a plane that this one does not: it is written all the same.
    for (std::size_t i = 0; i < count; ++i) {
      plane[i] = p < needed ? static_cast<std::byte>(zigzag(residuals[i]) >> (8 * p)) : std::byte{0};
    }
  }
  return used;
}

void splitPlane(const std::int8_t* residuals, std::size_t count, std::byte* plane) {
  for (std::size_t i = 0; i < count; ++i) plane[i] = static_cast<std::byte>(zigzag(residuals[i]));
}

void mergePlanes(const std::array<const std::byte*, kMaxPlanes>& planes, std::size_t planeCount,
                 std::size_t offset, std::size_t count, std::int32_t* residuals) {
  for (std::size_t i = 0; i < count; ++i) residuals[i] = 0;
  for (std::size_t p = 0; p < planeCount; ++p) {
    const std::byte* plane = planes[p] + offset;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t bits = static_cast<std::uint32_t>(plane[i]) << (8 * p);
      residuals[i] = static_cast<std::int32_t>(static_cast<std::uint32_t>(residuals[i]) | bits);
    }
  }
  for (std::size_t i = 0; i < count; ++i) residuals[i] = unzigzag(static_cast<std::uint32_t>(residuals[i]));
}

void mergePlane(const std::byte* plane, std::size_t count, std::int8_t* residuals) {
  for (std::size_t i = 0; i < count; ++i) {
    residuals[i] = static_cast<std::int8_t>(unzigzag(static_cast<std::uint32_t>(plane[i])));
  }
}

}  // namespace clothstream::codec
