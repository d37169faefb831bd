// SPDX-License-Identifier: MIT
// Scenes of a load test, from their creation to their deletion.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/load/link.h"
#include "clients/load/scene_request.h"
#include "clients/native/failure.h"
#include "clothstream/v1/scene.pb.h"

namespace clothstream::load {

// Equal scenes, created one after the other. Belongs to one thread.
class CreatedScenes {
 public:
  // `links` must outlive this. `token` proves who creates and deletes them; empty: none.
  CreatedScenes(Links& links, std::string token, v1::Scene definition);
  // Deletes the scenes if remove() has not.
  ~CreatedScenes();
  CreatedScenes(const CreatedScenes&) = delete;
  CreatedScenes& operator=(const CreatedScenes&) = delete;

  // Name of a scene, by its number from 0, whether it exists or not. No other load test uses the name.
  std::string name(std::uint32_t scene) const;
  // Returns whether the scene exists. If it does not, this takes the next step towards it: it requests the
  // creation of the next scene, or looks for the answer. Does not wait.
  bool exists(std::uint32_t scene);
  // Whether a requested scene has neither come nor failed.
  bool waits() const { return request_ != nullptr; }
  std::uint32_t count() const { return static_cast<std::uint32_t>(seconds_.size()); }
  // Why the next scene could not be created. None are created after that.
  const std::optional<Failure>& failure() const { return failure_; }
  // Time from the request to its answer, of a scene that exists.
  double creationSeconds(std::uint32_t scene) const { return seconds_[scene]; }

  struct Remaining {
    std::uint32_t scenes = 0;
    Failure why;  // of the first
  };
  // Deletes all scenes. Participants in them are disconnected. A scene that is being created is awaited for
  // some seconds and then given up. Returns those that could not be deleted.
  Remaining remove();

 private:
  void takeAnswer();
  std::unique_ptr<SceneRequest> creationOf(std::uint32_t scene) const;
  std::unique_ptr<SceneRequest> deletionOf(std::uint32_t scene) const;

  Links& links_;
  const std::string token_, prefix_;
  v1::Scene definition_;
  std::unique_ptr<SceneRequest> request_;  // of the next scene
  std::vector<double> seconds_;            // of each scene that exists
  std::optional<Failure> failure_;
};

}  // namespace clothstream::load
