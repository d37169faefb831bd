// SPDX-License-Identifier: MIT
// Records the scenes that tests/replay keeps (docs/recording.md): write_replays DIRECTORY [SCENE...].
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/e2e/temporary_directory.h"
#include "tests/replay/recorded_scene.h"

int main(int argc, char** argv) {
  using namespace clothstream;
  if (argc < 2) {
    std::fprintf(stderr, "usage: write_replays DIRECTORY [SCENE...]\n");
    return 2;
  }
  try {
    const std::vector<std::string> scenes =
        argc > 2 ? std::vector<std::string>(argv + 2, argv + argc) : replay::keptScenes();
    vulkan::Device device(vulkan::DeviceOptions{});
    const e2e::TemporaryDirectory directory;
    for (const std::string& name : scenes) {
      const std::string kept = (std::filesystem::path(argv[1]) / (name + ".mcap.gz")).string();
      replay::compress(replay::recordScene(device, name, directory.path()), kept);
      std::printf("%s: %zu bytes\n", kept.c_str(),
                  static_cast<std::size_t>(std::filesystem::file_size(kept)));
    }
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "write_replays: %s\n", error.what());
    return 1;
  }
}
