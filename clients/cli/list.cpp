// SPDX-License-Identifier: MIT
// Prints one table row or JSON object per scene.
#include "clients/cli/list.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "clients/cli/error.h"
#include "clients/cli/json_text.h"
#include "clients/cli/print.h"
#include "clients/grpc/scene_list.h"

namespace clothstream::cli {
namespace {

std::string json(const std::vector<SceneSummary>& scenes) {
  auto array = nlohmann::ordered_json::array();
  for (const SceneSummary& scene : scenes) {
    array.push_back({{"name", scene.name},
                     {"description", scene.description},
                     {"vertices", scene.vertexCount},
                     {"cloths", scene.clothCount},
                     {"participants", scene.participants},
                     {"maxParticipants", scene.maxParticipants},
                     {"running", scene.running},
                     {"paused", scene.paused},
                     {"created", scene.created}});
  }
  return jsonText(array, 2);
}

void printTable(const std::vector<SceneSummary>& scenes) {
  print("{:<20} {:>9} {:>7} {:>13}  {}\n", "SCENE", "VERTICES", "CLOTHS", "PARTICIPANTS", "DESCRIPTION");
  for (const SceneSummary& scene : scenes)
    print("{:<20} {:>9} {:>7} {:>13}  {}\n", scene.name, scene.vertexCount, scene.clothCount,
          fmt::format("{} of {}", scene.participants, scene.maxParticipants), scene.description);
}

}  // namespace

ExitCode list(const ListOptions& options) {
  const auto scenes = listScenes(options.address);
  if (!scenes) {
    return printError(scenes.error());
  }
  if (options.json)
    put(json(*scenes) + '\n');
  else
    printTable(*scenes);
  return kOk;
}

}  // namespace clothstream::cli
