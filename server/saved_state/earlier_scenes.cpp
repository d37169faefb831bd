// SPDX-License-Identifier: MIT
#include "server/saved_state/earlier_scenes.h"

#include <utility>

namespace clothstream::saved_state {

void EarlierScenes::addCreated(const std::string& name, scene::SavedScene saved) {
  createdNames_.insert(name);
  created_.push_back(std::move(saved));
}

std::vector<scene::SavedScene> EarlierScenes::takeCreated() {
  for (const scene::SavedScene& saved : created_) restored_.insert(saved.start.name);
  for (const auto& [name, contents] : ofServer_) unused_.insert(name);
  ofServer_.clear();
  return std::exchange(created_, {});
}

std::optional<SceneContents> EarlierScenes::takeOfServer(const std::string& name) {
  auto found = ofServer_.extract(name);
  return found ? std::optional(std::move(found.mapped())) : std::nullopt;
}

void EarlierScenes::remove(const std::string& name) {
  restored_.erase(name);
  createdNames_.erase(name);
}

}  // namespace clothstream::saved_state
