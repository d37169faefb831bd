// SPDX-License-Identifier: MIT
// Definition of a scene that participants change, and the description that peers get of it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "server/delivery/description_chunks.h"
#include "server/model/scene.h"
#include "server/model/stability.h"

namespace clothstream::scene {

// Epoch of the stream; a server has only one.
inline constexpr std::uint32_t kEpoch = 1;

// The description is made once for each definition that a peer asks about. Each has a content id that no
// other one has.
//
// Not thread-safe, except for start(), stability() and leastSubsteps(), which never change.
class SceneDefinition {
 public:
  // `cloths` is the serialised StreamDescription with the cloths, if they are not those of `start`.
  explicit SceneDefinition(model::Scene start, std::optional<std::string> cloths = {});

  const model::Scene& start() const { return start_; }
  const model::StabilityBound& stability() const { return stability_; }  // of start()
  // Minimum number of substeps with which `scene` is stable, at most start().substeps. `scene` is start()
  // with other parameters.
  std::uint32_t leastSubsteps(const model::Scene& scene) const;

  // The definition with all accepted changes.
  const model::Scene& accepted() const { return accepted_; }
  // Number of changes of accepted().
  std::uint64_t version() const { return version_; }
  void change(model::Scene scene);
  // Continues from a definition of an earlier run. Peers may hold descriptions of that run.
  void restore(model::Scene scene);

  // Description of accepted(); null until describe().
  std::shared_ptr<const delivery::DescriptionChunks> description() const { return description_; }
  // Makes the description. `rest` is the serialised StreamDescription without cloths.
  std::shared_ptr<const delivery::DescriptionChunks> describe(std::string rest);

 private:
  const model::Scene start_;
  const model::StabilityBound stability_;
  const std::shared_ptr<const std::string> cloths_;  // part of all descriptions

  model::Scene accepted_;
  std::uint64_t version_ = 0;
  std::shared_ptr<const delivery::DescriptionChunks> description_;
  std::uint64_t newestContent_ = 0;
};

}  // namespace clothstream::scene
