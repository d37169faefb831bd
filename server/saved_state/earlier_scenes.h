// SPDX-License-Identifier: MIT
// Scenes that earlier runs of the server have left.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/saved_state/contents.h"
#include "server/scene/scene_store.h"

namespace clothstream::saved_state {

// Each is taken at most once. Those with which earlier runs started, and this one does not, are not in use:
// they only take room. Not thread-safe.
class EarlierScenes {
 public:
  // A scene that a peer created.
  void addCreated(const std::string& name, scene::SavedScene saved);
  // A scene with which the server started.
  void addOfServer(const std::string& name, SceneContents contents) {
    ofServer_.emplace(name, std::move(contents));
  }

  // Scenes that peers created. Those of the server that have not been taken yet are not in use.
  std::vector<scene::SavedScene> takeCreated();
  // A scene of the server, or nothing.
  std::optional<SceneContents> takeOfServer(const std::string& name);
  // A scene that was taken goes on.
  void setRestored(const std::string& name) { restored_.insert(name); }
  // The scene is in use now, or nothing is left of it.
  void eraseUnused(const std::string& name) { unused_.erase(name); }
  // A scene was deleted, so that its name is free.
  void remove(const std::string& name);

  // Whether a scene that was taken goes on.
  bool isRestored(const std::string& name) const { return restored_.contains(name); }
  bool isCreated(const std::string& name) const { return createdNames_.contains(name); }
  bool isUnused(const std::string& name) const { return unused_.contains(name); }

 private:
  std::vector<scene::SavedScene> created_;         // until taken
  std::map<std::string, SceneContents> ofServer_;  // until taken
  std::set<std::string> createdNames_, restored_, unused_;
};

}  // namespace clothstream::saved_state
