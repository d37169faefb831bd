// SPDX-License-Identifier: MIT
// Writes residuals and their expected scales as a packet.
#include "proto/codec/hierarchical/frame_writer.h"

#include <algorithm>

#include "proto/codec/hierarchical/weight_plan.h"
#include "proto/codec/zigzag.h"

namespace clothstream::codec::hierarchical {
namespace {

// Maximum bytes of an escape and of the bits next to it.
constexpr std::size_t kMaxExtraBytes = 8;

std::size_t componentsOf(const StreamLayout& layout) {
  return kComponents + (layout.normals == NormalMode::octahedral ? 2 : 0);
}

}  // namespace

FrameWriter::FrameWriter(const StreamLayout& layout)
    : packet_(layout),
      symbols_(componentsOf(layout) * layout.vertexCount()),
      extra_((componentsOf(layout) * kMaxExtraBytes + 1) * layout.vertexCount() + kMaxExtraBytes),
      bits_(extra_.data()),
      bitsBefore_(bits_) {}

std::size_t FrameWriter::packetBound() const {
  return packet_.headerBound() + WeightPlan::kMaxBytes + symbols_.bound() + extra_.size();
}

void FrameWriter::begin() {
  symbols_.shrink(0);
  bits_ = BitWriter(extra_.data());
  normalScales_ = {};
  normals_ = 0;
}

void FrameWriter::beginPhase() {
  bitsBefore_ = bits_;
  symbolsBefore_ = symbols_.count();
  bits_.put(0, 1);
}

// A phase without residuals is written as a single bit; everything else of it is dropped.
void FrameWriter::endPhase(bool any) {
  if (any) return;
  bits_ = bitsBefore_;
  bits_.put(1, 1);
  symbols_.shrink(symbolsBefore_);
}

void FrameWriter::endCoarse() {
  coarseSymbols_ = symbols_.count();
  coarseBytes_ = bits_.bytesSince(extra_.data());
}

void FrameWriter::add(const ChunkResiduals& chunk, std::size_t count) {
  for (const Component component : kCodingOrder) {
    const Int32x4 tables = Int32x4::all(static_cast<std::int32_t>(distributionOf(component, 0)));
    for (std::size_t first = 0; first < count; first += kCoders) {
      const Int32x4 scales = Int32x4::load(&chunk.scales[component][first]);
      const Int32x4 residual = Int32x4::load(&chunk.residuals[component][first]);
      const Int32x4 number = residual.shiftedLeft(1) ^ residual.shiftedRight(31);
      const Int32x4 isHard = (scales > Int32x4::all(15)) | (number > Int32x4::all(kEscape - 1)) | number;
      if (first + kCoders <= count && isHard.signs() == 0 && !chunk.anyStays) {
        symbols_.addFour(0, scales + tables, number);
        continue;
      }
      for (std::size_t i = first; i < std::min(first + kCoders, count); ++i) code(chunk, component, i);
    }
  }
}

void FrameWriter::code(const ChunkResiduals& chunk, Component component, std::size_t i) {
  const auto scale = static_cast<std::uint32_t>(chunk.scales[component][i]);
  const std::size_t coder = i % kCoders;
  if (chunk.anyStays && chunk.stays[i]) {
    if (component != kAlongNormal) return;
    bits_.putGamma(kStays, kEscapeGammaBits);
    symbols_.add(coder, distributionOf(component, scale), kEscape);
    return;
  }
  put(chunk.residuals[component][i], component, scale, component == kAlongNormal ? kStays + 1 : 0, coder);
}

void FrameWriter::put(std::int32_t residual, Component component, std::uint32_t scale, std::uint32_t reserved,
                      std::size_t coder) {
  const unsigned raw = rawBits(scale);
  const std::uint32_t number = zigzag(residual);
  const std::uint32_t symbol = std::min(number >> raw, kEscape);
  if (symbol == kEscape) bits_.putGamma((number >> raw) - kEscape + reserved, kEscapeGammaBits);
  if (raw > 0) bits_.put(number & ((1u << raw) - 1), raw);
  symbols_.add(coder, distributionOf(component, scale), symbol);
}

void FrameWriter::addNormal(std::int8_t u, std::int8_t v) {
  const std::array<std::int8_t, 2> residuals{u, v};
  for (std::size_t c = 0; c < 2; ++c) {
    put(residuals[c], kAlongU, normalScales_[c].scale(), 0, (2 * normals_ + c) % kCoders);
    normalScales_[c].add(residuals[c]);
  }
  ++normals_;
}

std::size_t FrameWriter::write(const FrameRole& role, std::span<const std::byte> weights,
                               std::span<std::byte> out) {
  std::byte* end = std::ranges::copy(weights, packet_.begin(role, out)).out;
  packet_.endSection(end);
  const RansWriter::Written symbols = symbols_.write(end, coarseSymbols_);
  packet_.endSection(end + symbols.firstBytes);
  end += symbols.bytes;
  packet_.endSection(end);
  const auto extraBytes = static_cast<std::size_t>(bits_.finish() - extra_.data());
  packet_.endSection(end + coarseBytes_);
  end = std::copy_n(extra_.data(), extraBytes, end);
  packet_.endSection(end);
  return packet_.finish();
}

}  // namespace clothstream::codec::hierarchical
