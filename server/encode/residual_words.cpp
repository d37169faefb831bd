// SPDX-License-Identifier: MIT
// Words of residuals that the device writes.
#include "server/encode/residual_words.h"

#include "proto/codec/hierarchical/residual_model.h"
#include "shaders/encode/hierarchical/hierarchical.h"

namespace clothstream::encode {

bool unpackResiduals(const ResidualWords& words, codec::hierarchical::ChunkResiduals& out) {
  using namespace codec::hierarchical;
  const std::size_t count = words.first.size();
  std::uint32_t all = 0, special = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t a = words.first[i], b = words.second[i];
    out.residuals[kAlongU][i] = static_cast<std::int16_t>(a);
    out.residuals[kAlongV][i] = static_cast<std::int32_t>(a) >> 16;
    out.residuals[kAlongNormal][i] = static_cast<std::int16_t>(b);
    out.scales[kAlongU][i] = static_cast<std::int32_t>(b >> 16 & 31u);
    out.scales[kAlongV][i] = static_cast<std::int32_t>(b >> 21 & 31u);
    out.scales[kAlongNormal][i] = static_cast<std::int32_t>(b >> 26 & 31u);
    all |= a | (b & (shared::kSpecialWord | 0xffffu));
    special |= b;
  }
  out.anyStays = false;
  if ((special & shared::kSpecialWord) == 0) return all != 0;
  for (std::size_t i = 0; i < count; ++i) {
    const bool isSpecial = (words.second[i] & shared::kSpecialWord) != 0;
    const bool isWide = isSpecial && (words.first[i] | (words.second[i] & 0xffffu)) != 0;
    out.stays[i] = isSpecial && !isWide;
    out.anyStays = out.anyStays || out.stays[i];
    for (std::size_t c = 0; isWide && c < kComponents; ++c)
      out.residuals[c][i] = words.wide[kComponents * i + c];
  }
  return true;
}

}  // namespace clothstream::encode
