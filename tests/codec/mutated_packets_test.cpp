// SPDX-License-Identifier: MIT
#include <algorithm>
#include <memory>
#include <random>

#include <gtest/gtest.h>

#include "tests/codec/hostile_packets.h"

namespace clothstream::codec {
namespace {

using Bytes = std::vector<std::byte>;

class Mutator {
 public:
  explicit Mutator(std::uint32_t seed) : random_(seed) {}

  std::size_t below(std::size_t bound) { return random_() % bound; }

  // Applies one to four changes that typically break parsers: bits, bytes, extreme values, cuts, copies,
  // splices.
  Bytes mutate(Bytes bytes, const Bytes& other) {
    for (std::size_t changes = 1 + below(4); changes > 0 && !bytes.empty(); --changes) change(bytes, other);
    return bytes;
  }

 private:
  void change(Bytes& bytes, const Bytes& other) {
    // Half of the changes hit the header, which is small and determines everything else.
    const std::size_t at = below(below(2) == 0 ? std::min<std::size_t>(bytes.size(), 24) : bytes.size());
    const auto position = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    const std::size_t length = std::min(bytes.size() - at, 1 + below(8));
    switch (below(8)) {
      case 0:
        bytes[at] ^= std::byte{static_cast<std::uint8_t>(1u << below(8))};
        return;
      case 1:
        bytes[at] = static_cast<std::byte>(below(256));
        return;
      case 2:
        std::fill_n(position, length, std::byte{0xff});
        return;
      case 3:
        std::fill_n(position, length, std::byte{0});
        return;
      case 4:
        bytes.erase(position, position + static_cast<std::ptrdiff_t>(length));
        return;
      case 5:
        bytes.insert(position, length, static_cast<std::byte>(below(256)));
        return;
      case 6:
        bytes.resize(at);
        return;
      default:
        for (std::size_t i = 0; i < length && at + i < other.size(); ++i) bytes[at + i] = other[at + i];
    }
  }

  std::mt19937 random_;
};

TEST(MutatedPackets, KeepTheDecodersPromises) {
  const std::vector<GoldenStream> streams = readGoldenStreams();
  Mutator mutator(1);
  for (int i = 0; i < 10'000; ++i) {
    const GoldenStream& stream = streams[mutator.below(streams.size())];
    const std::size_t place = mutator.below(stream.packets.size());
    const GoldenStream& otherStream = streams[mutator.below(streams.size())];
    const Bytes& other = otherStream.packets[mutator.below(otherStream.packets.size())].bytes;
    const Bytes mutated = mutator.mutate(stream.packets[place].bytes, other);
    // Exactly sized, so that the address sanitizer detects a read past the end.
    const auto copy = std::make_unique<std::byte[]>(mutated.size());
    std::copy(mutated.begin(), mutated.end(), copy.get());
    decodeHostile(stream, place, {copy.get(), mutated.size()});
  }
}

}  // namespace
}  // namespace clothstream::codec
