// SPDX-License-Identifier: MIT
// Writes each golden packet as an input of fuzz_decoder. Run it from the project's root:
//    build/fuzz/bin/write_fuzz_corpus DIRECTORY
#include <cstdio>
#include <exception>
#include <fstream>
#include <string>

#include "tests/codec/golden.h"

int main(int argc, char** argv) try {
  if (argc != 2) {
    std::fputs("usage: write_fuzz_corpus DIRECTORY\n", stderr);
    return 2;
  }
  const auto streams = clothstream::codec::readGoldenStreams();
  for (std::size_t s = 0; s < streams.size(); ++s) {
    for (std::size_t place = 0; place < streams[s].packets.size(); ++place) {
      const auto& packet = streams[s].packets[place];
      std::ofstream out(std::string(argv[1]) + "/" + packet.file, std::ios::binary);
      out.put(static_cast<char>(s + streams.size() * place));
      for (const std::byte byte : packet.bytes) out.put(static_cast<char>(byte));
      if (!out.flush()) throw std::runtime_error("cannot write to " + std::string(argv[1]));
    }
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
