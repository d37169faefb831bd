// SPDX-License-Identifier: MIT
// States of a scene as raw numbers for researchers, and beside them what they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>

#include <nlohmann/json.hpp>

namespace clothstream::step {

// FILE holds frames of little-endian float32, one after the other: of each node in order its position (m) and
// its velocity (m/s), six numbers. FILE.json says the rest (docs/simulation.md); finish() writes it, whole or
// not at all. Until then there is none beside FILE.
class StateFile {
 public:
  // Throws std::runtime_error with the path and what the system said, as the others do.
  explicit StateFile(std::filesystem::path path);

  void append(std::span<const std::byte> frame);
  // `description` gets this format's own fields: format, file, dtype, shape, columns.
  void finish(const nlohmann::ordered_json& description, std::uint32_t nodes);
  std::uint64_t frames() const { return frames_; }

 private:
  std::filesystem::path sidecar() const;

  std::filesystem::path path_;
  std::ofstream file_;
  std::uint64_t frames_ = 0;
};

}  // namespace clothstream::step
