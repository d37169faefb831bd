// SPDX-License-Identifier: MIT
// States of a scene as raw numbers for researchers, with a description.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>

#include <nlohmann/json.hpp>

#include "server/model/scene.h"

namespace clothstream::step {

// Names the file and the system's message.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// FILE has frames of little-endian float32: for each node in order its position (m) and velocity (m/s), six
// numbers. FILE.json describes them (docs/simulation.md). finish() writes FILE.json completely or not at all;
// before that it does not exist.
class StateFile {
 public:
  // Throws FileError, like the other functions.
  explicit StateFile(std::filesystem::path path);

  void append(std::span<const std::byte> frame);
  // Adds this format's fields to `description`: format, file, dtype, shape, columns.
  void finish(const nlohmann::ordered_json& description, std::uint32_t nodes);
  std::uint64_t frames() const { return frames_; }

 private:
  std::filesystem::path sidecar() const;

  std::filesystem::path path_;
  std::ofstream file_;
  std::uint64_t frames_ = 0;
};

// Describes the cloths of a scene: name, first node, number of nodes, and rows and columns of a grid.
nlohmann::ordered_json describeCloths(const model::Scene& scene);

}  // namespace clothstream::step
