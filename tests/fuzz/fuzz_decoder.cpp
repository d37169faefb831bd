// SPDX-License-Identifier: MIT
// Entry point for libFuzzer. The first byte selects stream and place; the rest is the packet. Run it from the
// project's root:
//    build/fuzz/bin/fuzz_decoder -max_len=4096 CORPUS tests/golden
#include "tests/fuzz/decoder_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace clothstream::codec;
  static const std::vector<GoldenStream> streams = readGoldenStreams();
  if (size == 0) return 0;
  const GoldenStream& stream = streams[data[0] % streams.size()];
  const std::size_t place = data[0] / streams.size() % stream.packets.size();
  decodeHostile(stream, place, std::as_bytes(std::span(data, size)).subspan(1));
  return 0;
}
