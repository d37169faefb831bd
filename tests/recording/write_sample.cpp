// SPDX-License-Identifier: MIT
// Writes the sample of the tests for other readers: write_sample FILE.mcap FRAMES. FILE.garbage.mcap is the
// same recording with packets that cannot be decoded.
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "proto/recording/file.h"
#include "tests/recording/sample.h"

int main(int argc, char** argv) {
  using namespace clothstream::recording;
  if (argc != 3) return 2;
  std::filesystem::remove(argv[1]);
  auto file = OutputFile::create(argv[1]);
  if (!file) return 1;
  const auto frames = static_cast<std::uint32_t>(std::atoi(argv[2]));
  writeSample([&](std::string_view bytes) { return file->write(bytes); }, frames);
  std::ofstream garbage(std::filesystem::path(argv[1]).replace_extension(".garbage.mcap"), std::ios::binary);
  garbage << withGarbage(sampleRecording(frames));
  return garbage.flush() ? 0 : 1;
}
