// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/scene_json_target.h"

#include "server/messages/scene_file.h"
#include "server/messages/scene_message.h"

namespace clothstream::fuzz {
namespace {

// The text is under test, not the scene: fewer nodes take less time.
constexpr std::uint64_t kMaxNodes = 1024;

void run(std::span<const std::byte> input) {
  const auto scene = messages::parseScene(textOf(input), "input", {}, kMaxNodes);
  if (!scene) return require(!scene.error().text.empty(), "an error has a text");
  const std::string json = messages::toJson(*scene);
  const auto again = messages::parseScene(json, "input");
  require(again.has_value(), "a written scene file is accepted");
  require(messages::toJson(*again) == json, "a scene file is written and read without a change");
}

}  // namespace

const Target kSceneJsonTarget{.name = "scene_json", .run = &run};

}  // namespace clothstream::fuzz
