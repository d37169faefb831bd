// SPDX-License-Identifier: MIT
// `join --input`: input of a participant from lines of JSON. docs/command-line.md describes them.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "clients/core/core.h"

namespace clothstream::cli {

// Content of one line. Members that are not set change nothing.
struct InputLine {
  struct Head {
    std::array<float, 3> position{};                  // m
    std::optional<std::array<float, 4>> orientation;  // quaternion x y z w
    float radius = 0.1f;                              // m
  };
  struct Hand {
    std::uint32_t side = CS_HAND_LEFT;
    std::vector<float> joints;  // x, y, z and radius of each joint, m; empty: no hand
  };
  struct Attachment {
    std::string name;
    std::array<float, 3> position{};                  // m
    std::optional<std::array<float, 4>> orientation;  // quaternion x y z w
    bool jumps = false;
  };

  struct Joints {
    std::string collider;
    std::vector<float> poses;  // position and quaternion x y z w of each joint
    bool jumps = false;
  };

  double after = 0;  // seconds to wait after the line before
  std::optional<std::vector<cs_own_collider>> colliders;
  std::optional<std::vector<cs_grab>> grabs;
  std::optional<std::optional<Head>> head;  // an empty inner value removes the head
  std::vector<Hand> hands;
  std::vector<Attachment> attachments;
  std::vector<Joints> joints;
  std::optional<std::string> wear;  // collider to take as the body; empty gives it back
  std::optional<cs_tracked_body> body;

  // If `wear` is not a body, the error names the bodies of the scene.
  [[nodiscard]] tl::expected<void, std::string> send(cs_client* client, std::uint64_t nowUs) const;
};

// The error names the part of the line that is wrong, and what is allowed.
[[nodiscard]] tl::expected<InputLine, std::string> parseInputLine(std::string_view line);

// Lines of a file, pipe or terminal, each at its time. Does not block.
class InputLines {
 public:
  // "-" is standard input. The error names the path.
  [[nodiscard]] static tl::expected<InputLines, std::string> open(const std::string& path);
  ~InputLines();
  InputLines(InputLines&& other) noexcept;
  InputLines& operator=(InputLines&&) = delete;

  // Next line whose time has come, if any. The error names the path and the number of the line.
  [[nodiscard]] tl::expected<std::optional<InputLine>, std::string> next(
      std::chrono::steady_clock::time_point now);
  // Whether all lines were returned.
  bool atEnd() const { return ended_ && !waiting_ && text_.empty(); }
  // Path and number of the newest line, for errors.
  std::string place() const;

 private:
  InputLines(int file, std::string path) : file_(file), path_(std::move(path)) {}
  // Reads what is there.
  tl::expected<void, std::string> read();
  // Removes the first complete line from text_.
  std::optional<std::string> takeLine();

  int file_ = -1;
  std::string path_;
  std::string text_;  // read, not yet parsed
  bool ended_ = false;
  std::size_t number_ = 0;                                     // of the newest line, from 1
  std::optional<InputLine> waiting_;                           // parsed; its time has not come
  std::optional<std::chrono::steady_clock::time_point> last_;  // time of the newest returned line
};

}  // namespace clothstream::cli
