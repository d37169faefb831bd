// SPDX-License-Identifier: MIT
// Blocks of numbers that each say how they are written.
#include "proto/codec/hierarchical/packed_blocks.h"

#include <algorithm>

#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/residual_model.h"
#include "proto/codec/zigzag.h"

namespace clothstream::codec::hierarchical {
namespace {

using Numbers = std::span<const std::uint32_t>;

// `reserved`: number of escape values with another meaning.
unsigned bitsOf(std::uint32_t number, unsigned low, std::uint32_t reserved) {
  if (number == kStayNumber) return kEscape + gammaBits(kStays, kEscapeGammaBits);
  const std::uint32_t ones = number >> low;
  if (ones < kEscape) return ones + 1 + low;
  return kEscape + gammaBits(ones - kEscape + reserved, kEscapeGammaBits) + low;
}

void put(BitWriter& out, std::uint32_t number, unsigned low, std::uint32_t reserved) {
  const bool stays = number == kStayNumber;
  const std::uint32_t ones = number >> low;
  if (!stays && ones < kEscape) {
    out.put((1u << ones) - 1, ones + 1);
  } else {
    out.put((1u << kEscape) - 1, kEscape);
    out.putGamma(stays ? kStays : ones - kEscape + reserved, kEscapeGammaBits);
  }
  if (low > 0 && !stays) out.put(number & ((1u << low) - 1), low);
}

bool isZero(Numbers numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](std::uint32_t number) { return number == 0; });
}

template <typename Use>
void forEachRun(Numbers numbers, Use&& use) {
  for (std::size_t i = 0; i < numbers.size(); i += kRunVertices)
    use(numbers.subspan(i, std::min<std::size_t>(kRunVertices, numbers.size() - i)));
}

std::uint32_t bitsOf(Numbers numbers, Mode mode, std::uint32_t reserved) {
  std::uint32_t bits = 0;
  if (mode != kRuns) {
    for (const std::uint32_t number : numbers) bits += bitsOf(number, mode - kFirstPlain, reserved);
    return bits;
  }
  forEachRun(numbers,
             [&](Numbers run) { bits += 1 + (isZero(run) ? 0 : bitsOf(run, kFirstPlain, reserved)); });
  return bits;
}

// Tries modes from the first on, as long as the next one takes fewer bits.
Mode modeOf(Numbers numbers, std::uint32_t reserved) {
  if (isZero(numbers)) return kNoNumbers;
  Mode mode = kRuns;
  for (std::uint32_t bits = bitsOf(numbers, mode, reserved); mode + 1 < kModes; ++mode) {
    const std::uint32_t next = bitsOf(numbers, mode + 1, reserved);
    if (next >= bits) break;
    bits = next;
  }
  return mode;
}

void put(BitWriter& out, Numbers numbers, Mode mode, std::uint32_t reserved) {
  if (mode == kNoNumbers) return;
  if (mode == kRuns) {
    forEachRun(numbers, [&](Numbers run) {
      out.put(isZero(run) ? 1 : 0, 1);
      if (!isZero(run)) put(out, run, kFirstPlain, reserved);
    });
    return;
  }
  for (const std::uint32_t number : numbers) put(out, number, mode - kFirstPlain, reserved);
}

// One component of a block.
class Block {
 public:
  Block(BitReader& in, std::int32_t* residuals, std::uint8_t* stays, std::size_t count)
      : in_(in), residuals_(residuals), stays_(stays), count_(count) {}

  void read(Mode mode) {
    if (mode != kRuns) return readPlain(0, count_, mode - kFirstPlain);
    for (std::size_t first = 0; first < count_; first += kRunVertices) {
      if (in_.get(1) == 0) readPlain(first, std::min(first + kRunVertices, count_), 0);
    }
  }

 private:
  void readPlain(std::size_t begin, std::size_t end, unsigned low) {
    BitReader in = in_;  // keeps the reader in registers
    for (std::size_t i = begin; i < end; ++i) {
      std::uint32_t number = in.getOnes(kEscape);
      if (number == kEscape) {
        std::uint32_t beyond = in.getGamma(kEscapeGammaBits);
        if (stays_ != nullptr) {
          if (beyond == kStays) {
            stays_[i] = 1;
            continue;
          }
          --beyond;
        }
        number += beyond;
      }
      if (low > 0) number = number << low | in.get(low);
      residuals_[i] = unzigzag(number);
    }
    in_ = in;
  }

  BitReader& in_;
  std::int32_t* residuals_;
  std::uint8_t* stays_;
  std::size_t count_;
};

}  // namespace

void writeGroup(const GroupNumbers& numbers, BitWriter& out) {
  const auto of = [&](std::size_t component, std::size_t first, std::size_t count) {
    return Numbers(numbers.components[component] + first, count);
  };
  std::size_t components = 0;
  bool isQuiet = true;
  for (; components < numbers.components.size() && numbers.components[components] != nullptr; ++components)
    isQuiet = isQuiet && isZero(of(components, 0, numbers.count));
  out.put(isQuiet ? 1 : 0, 1);
  std::array<Mode, 3> before{};
  for (std::size_t first = 0; first < numbers.count && !isQuiet; first += kBlockVertices) {
    for (std::size_t c = 0; c < components; ++c) {
      const Numbers block = of(c, first, std::min<std::size_t>(kBlockVertices, numbers.count - first));
      const std::uint32_t reserved = c == 0 && numbers.hasStays ? kStays + 1 : 0;
      const Mode mode = modeOf(block, reserved);
      put(out, zigzag(static_cast<std::int32_t>(mode - before[c])), 0, 0);
      put(out, block, mode, reserved);
      before[c] = mode;
    }
  }
  out.finish();
}

bool readGroup(BitReader& in, const GroupResiduals& residuals) {
  for (std::int32_t* component : residuals.components)
    if (component != nullptr) std::fill_n(component, residuals.count, 0);
  if (residuals.stays != nullptr) std::fill_n(residuals.stays, residuals.count, std::uint8_t{0});
  if (in.get(1) != 0) return in.endByte();
  std::array<Mode, 3> modes{};
  for (std::size_t first = 0; first < residuals.count; first += kBlockVertices) {
    for (std::size_t c = 0; c < modes.size() && residuals.components[c] != nullptr; ++c) {
      std::uint32_t change = in.getOnes(kEscape);
      if (change == kEscape) change += in.getGamma(kEscapeGammaBits);
      modes[c] += static_cast<std::uint32_t>(unzigzag(change));
      if (modes[c] >= kModes) return false;
      if (modes[c] == kNoNumbers) continue;
      Block(in, residuals.components[c] + first,
            c == 0 && residuals.stays != nullptr ? residuals.stays + first : nullptr,
            std::min<std::size_t>(kBlockVertices, residuals.count - first))
          .read(modes[c]);
    }
  }
  return in.endByte();
}

}  // namespace clothstream::codec::hierarchical
