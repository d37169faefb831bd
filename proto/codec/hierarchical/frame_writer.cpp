// SPDX-License-Identifier: MIT
// Selects the writer of a codec.
#include "proto/codec/hierarchical/frame_writer.h"

#include "proto/codec/hierarchical/packed_frame_writer.h"
#include "proto/codec/hierarchical/rans_frame_writer.h"

namespace clothstream::codec::hierarchical {

std::unique_ptr<FrameWriter> makeFrameWriter(const StreamLayout& layout) {
  if (layout.codec == kCodecPacked) return std::make_unique<PackedFrameWriter>(layout);
  return std::make_unique<RansFrameWriter>(layout);
}

}  // namespace clothstream::codec::hierarchical
