// SPDX-License-Identifier: MIT
// Residuals of a packet of codec 3. All are read before the first vertex is placed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/codec/array.h"
#include "proto/codec/hierarchical/packed_blocks.h"
#include "proto/codec/hierarchical/residual_model.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec::hierarchical {

class PackedResiduals {
 public:
  // False if memory is out.
  [[nodiscard]] bool allocate(const StreamLayout& layout, std::size_t coarseVertices);

  // False if the bytes are not exactly the groups of the coarse vertices.
  [[nodiscard]] bool readCoarse(std::span<const std::byte> section);
  // False if the bytes are not exactly the groups of the other vertices and, if the stream sends normals, of
  // all normals.
  [[nodiscard]] bool readFine(std::span<const std::byte> section);

  // Indexed by slot.
  const std::int32_t* residuals(Component component) const { return residuals_[component].data(); }
  const std::uint8_t* stays() const { return stays_.data(); }
  // Residual along u (0) or v (1).
  std::int32_t ofNormal(std::size_t component, std::size_t vertex) const {
    return ofNormals_[component][vertex];
  }

 private:
  GroupResiduals all() const;

  std::size_t coarse_ = 0;
  std::array<Array<std::int32_t>, kComponents> residuals_;
  Array<std::uint8_t> stays_;
  std::array<Array<std::int32_t>, 2> ofNormals_;
};

}  // namespace clothstream::codec::hierarchical
