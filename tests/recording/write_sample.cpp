// SPDX-License-Identifier: MIT
// Writes the sample of the tests to a file, for other readers: write_sample FILE FRAMES.
#include <cstdlib>
#include <filesystem>

#include "proto/recording/file.h"
#include "tests/recording/sample.h"

int main(int argc, char** argv) {
  using namespace clothstream::recording;
  if (argc != 3) return 2;
  std::filesystem::remove(argv[1]);
  auto file = OutputFile::create(argv[1]);
  if (!file) return 1;
  writeSample([&](std::string_view bytes) { return file->write(bytes); },
              static_cast<std::uint32_t>(std::atoi(argv[2])));
  return 0;
}
