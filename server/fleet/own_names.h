// SPDX-License-Identifier: MIT
// Names of the scenes of a server, and of those that move.
#pragma once

#include <functional>
#include <set>
#include <string>

namespace clothstream::fleet {

// A scene that leaves or arrives may have an entry that does not fit to what this server offers. Not
// thread-safe.
class OwnNames {
 public:
  // The server offers this scene.
  void offer(const std::string& name) {
    arriving_.erase(name);
    had_.insert(name);
  }
  // Forgets scenes that the server neither offers nor owns any more.
  void forgetIf(const std::function<bool(const std::string& name)>& isGone) { std::erase_if(had_, isGone); }

  void beginMove(const std::string& name) { leaving_.insert(name); }
  void endMove(const std::string& name) { leaving_.erase(name); }
  void expect(const std::string& name) { arriving_.insert(name); }
  void expectNoMore(const std::string& name) { arriving_.erase(name); }

  bool leaves(const std::string& name) const { return leaving_.contains(name); }
  bool moves(const std::string& name) const { return leaves(name) || arriving_.contains(name); }
  // Whether the server has offered the scene.
  bool had(const std::string& name) const { return had_.contains(name); }

 private:
  std::set<std::string> had_, leaving_, arriving_;
};

}  // namespace clothstream::fleet
