// SPDX-License-Identifier: MIT
#include "tests/codec/packet_crafter.h"

#include <array>
#include <new>
#include <optional>
#include <stdexcept>

#include "proto/codec/hierarchical/packet_assembly.h"
#include "proto/codec/hierarchical/residual_model.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/zigzag.h"

namespace clothstream::codec {

using namespace hierarchical;

PacketCrafter::PacketCrafter(const StreamLayout& layout)
    : layout_(layout), kept_(startingWeights()), made_(kept_) {
  if (!hierarchy_.build(layout)) throw std::bad_alloc();
}

std::vector<std::byte> PacketCrafter::craft(const FrameRole& role, std::uint32_t seed) {
  random_.seed(seed);
  PacketAssembly packet(layout_);
  std::vector<std::byte> out(4096 + 64 * std::size_t{layout_.vertexCount()});
  BitWriter bits(packet.begin(role, out));
  writeWeights(bits);
  std::byte* end = bits.finish();
  packet.endSection(end);
  packet.endSection(end);
  packet.endSection(end);
  for (std::size_t phase = 0; phase < hierarchy_.coarsePhases; ++phase) bits.put(1, 1);
  packet.endSection(end + bits.bytesSince(end));
  for (std::size_t phase = hierarchy_.coarsePhases; phase < hierarchy_.phases.size(); ++phase) bits.put(1, 1);
  packet.endSection(bits.finish());
  out.resize(packet.finish());
  return out;
}

std::vector<std::byte> PacketCrafter::craftWrong(const FrameRole& role, Fault fault) {
  fault_ = fault;
  std::vector<std::byte> packet = craft(role, 1);
  fault_ = Fault::none;
  return packet;
}

void PacketCrafter::writeWeights(BitWriter& out) {
  made_ = kept_;
  out.put(0, 1);
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    out.put(1, 1);
    for (std::size_t f = 0; f < kFeatures; ++f) {
      if (fault_ == Fault::gammaNumberOf31Bits && c == 5 && f + 1 == kFeatures) {
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

std::vector<std::byte> withNumberRaised(std::span<const std::byte> packet, std::uint32_t by) {
  const std::optional<ParsedPacket> parsed = parsePacket(packet);
  if (!parsed || parsed->header.sectionCount != kSections)
    throw std::invalid_argument("the packet has other sections");
  PacketHeader header = parsed->header;
  const auto body = parsed->body.first(parsed->body.size() - header.sectionBytes[kCoarseBits]);
  const auto section = parsed->body.subspan(body.size());
  BitReader in(section);
  std::vector<std::byte> bits(section.size() + 8);
  BitWriter raised(bits.data());
  raised.put(in.get(1), 1);
  raised.putGamma(in.getGamma(kEscapeGammaBits) + by, kEscapeGammaBits);
  for (std::size_t i = 0; i < 8 * section.size() && !in.atEnd(); ++i) raised.put(in.get(1), 1);
  bits.resize(static_cast<std::size_t>(raised.finish() - bits.data()));
  header.sectionBytes[kCoarseBits] = static_cast<std::uint32_t>(bits.size());
  std::vector<std::byte> out(headerBound(header));
  out.resize(writeHeader(header, out));
  out.insert(out.end(), body.begin(), body.end());
  out.insert(out.end(), bits.begin(), bits.end());
  return out;
}

}  // namespace clothstream::codec
