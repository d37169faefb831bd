// SPDX-License-Identifier: MIT
#include "tests/codec/packet_crafter.h"

#include <algorithm>
#include <array>
#include <new>
#include <optional>
#include <stdexcept>

#include "proto/codec/hierarchical/packed_blocks.h"
#include "proto/codec/hierarchical/packet_assembly.h"
#include "proto/codec/hierarchical/residual_model.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/zigzag.h"

namespace clothstream::codec {
namespace {

using namespace hierarchical;

// Writes a number of codec 3 in two parts: what is written in unary, and the low bits.
void put(std::uint32_t ones, std::uint32_t bits, std::uint32_t low, std::uint32_t reserved, BitWriter& out) {
  if (ones < kEscape) {
    out.put((1u << ones) - 1, ones + 1);
  } else {
    out.put((1u << kEscape) - 1, kEscape);
    out.putGamma(ones - kEscape + reserved, kEscapeGammaBits);
  }
  out.put(bits, low);
}

void putStay(BitWriter& out) {
  out.put((1u << kEscape) - 1, kEscape);
  out.putGamma(kStays, kEscapeGammaBits);
}

}  // namespace

PacketCrafter::PacketCrafter(const StreamLayout& layout)
    : layout_(layout), kept_(startingWeights()), made_(kept_) {
  if (!hierarchy_.build(layout)) throw std::bad_alloc();
}

std::vector<std::byte> PacketCrafter::craft(const FrameRole& role, std::uint32_t seed) {
  random_.seed(seed);
  const bool key = role.kind == PacketKind::key;
  PacketAssembly packet(layout_);
  std::vector<std::byte> out(4096 + 64 * std::size_t{layout_.vertexCount()});
  BitWriter bits(packet.begin(role, out));
  writeWeights(key, bits);
  std::byte* end = bits.finish();
  packet.endSection(end);
  const std::size_t coarse = hierarchy_.coarseVertices, all = hierarchy_.vertexOf.size();
  if (layout_.codec == kCodecPacked) {
    writeGroups(coarse, kComponents, bits);
    packet.endSection(bits.finish());
    writeGroups(all - coarse, kComponents, bits);
    if (layout_.normals == NormalMode::octahedral) writeGroups(all, 2, bits);
    packet.endSection(bits.finish());
  } else {
    packet.endSection(end);
    packet.endSection(end);
    for (std::size_t phase = 0; phase < hierarchy_.coarsePhases; ++phase) bits.put(1, 1);
    packet.endSection(end + bits.bytesSince(end));
    for (std::size_t phase = hierarchy_.coarsePhases; phase < hierarchy_.phases.size(); ++phase)
      bits.put(1, 1);
    packet.endSection(bits.finish());
  }
  out.resize(packet.finish());
  if (key) made_ = startingWeights();
  return out;
}

std::vector<std::byte> PacketCrafter::craftWrong(const FrameRole& role, Fault fault) {
  fault_ = fault;
  std::vector<std::byte> packet = craft(role, 1);
  fault_ = Fault::none;
  return packet;
}

void PacketCrafter::writeWeights(bool key, BitWriter& out) {
  made_ = key ? keyFrameWeights() : kept_;
  out.put(0, 1);
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    out.put(1, 1);
    for (std::size_t f = firstWeight(key); f < endWeight(key); ++f) {
      if (fault_ == Fault::gammaNumberOf31Bits && c == 5 && f + 1 == endWeight(key)) {
        out.put(0, 31 - kWeightGammaBits);
        out.put(1, 1);
        out.put(0, 31);
        continue;
      }
      // Both ends of the range, and everything between.
      const std::int32_t limit = kMaxWeight;
      std::int32_t weight = static_cast<std::int32_t>(below(2 * kMaxWeight + 1)) - limit;
      if (below(4) == 0) weight = below(2) == 0 ? -limit : limit;
      if (fault_ != Fault::none) weight = 0;
      if (fault_ == Fault::weightBeyondTheLimit && c == 5) weight = limit + 1;
      out.putGamma(zigzag(weight - made_[c][f]), kWeightGammaBits);
      made_[c][f] = static_cast<std::int16_t>(weight);
    }
  }
}

void PacketCrafter::writeGroups(std::size_t vertices, std::size_t components, BitWriter& out) {
  for (std::size_t first = 0; first < vertices; first += kGroupVertices) {
    const bool isQuiet = fault_ != Fault::none && fault_ != Fault::coordinateBeyondTheLimit;
    out.put(isQuiet ? 1 : 0, 1);
    std::array<std::uint32_t, kComponents> modes{};
    const std::size_t end = isQuiet ? first : std::min<std::size_t>(first + kGroupVertices, vertices);
    for (std::size_t begin = first; begin < end; begin += kBlockVertices)
      writeBlock(std::min<std::size_t>(kBlockVertices, end - begin), components, modes, out);
    out.finish();
  }
}

void PacketCrafter::writeBlock(std::size_t vertices, std::size_t components, std::span<std::uint32_t> modes,
                               BitWriter& out) {
  for (std::size_t c = 0; c < components; ++c) {
    constexpr std::array<std::uint32_t, 6> kChoice{0, 1, 2, 7, 16, kModes - 1};
    const std::uint32_t mode =
        fault_ == Fault::coordinateBeyondTheLimit ? kModes - 1 : kChoice[below(kChoice.size())];
    put(zigzag(static_cast<std::int32_t>(mode - modes[c])), 0, 0, 0, out);
    modes[c] = mode;
    const std::uint32_t reserved = c == 0 && components == kComponents ? kStays + 1 : 0;
    if (mode == kNoNumbers) continue;
    for (std::size_t i = 0; i < vertices; ++i) {
      if (mode == kRuns && i % kRunVertices == 0) out.put(0, 1);
      writeNumber(mode == kRuns ? 0 : mode - kFirstPlain, reserved, out);
    }
  }
}

void PacketCrafter::writeNumber(std::uint32_t low, std::uint32_t reserved, BitWriter& out) {
  if (fault_ == Fault::coordinateBeyondTheLimit) return put(0, (1u << 28) - 2, low, reserved, out);
  const std::uint32_t kind = below(16);
  if (kind == 0 && reserved > 0) return putStay(out);
  const std::uint32_t number = kind < 10 ? below(7) : kind < 14 ? below(1 << 13) : below(1u << 23);
  std::uint32_t ones = number >> low;
  // The lowest 32 bits of the number are the same.
  if (low == 29 && below(2) == 0) ones += 8;
  put(ones, number & ((1u << low) - 1), low, reserved, out);
}

std::vector<std::byte> withBoundaryMoved(std::span<const std::byte> packet, std::size_t section,
                                         std::uint32_t bytes) {
  const std::optional<ParsedPacket> parsed = parsePacket(packet);
  if (!parsed || section + 1 >= parsed->header.sectionCount || parsed->header.sectionBytes[section] < bytes)
    throw std::invalid_argument("the packet has no such bytes");
  PacketHeader header = parsed->header;
  header.sectionBytes[section] -= bytes;
  header.sectionBytes[section + 1] += bytes;
  std::vector<std::byte> out(headerBound(header));
  out.resize(writeHeader(header, out));
  out.insert(out.end(), parsed->body.begin(), parsed->body.end());
  return out;
}

}  // namespace clothstream::codec
