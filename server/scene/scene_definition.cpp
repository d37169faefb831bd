// SPDX-License-Identifier: MIT
#include "server/scene/scene_definition.h"

#include <algorithm>
#include <random>
#include <utility>

#include "server/messages/description.h"

namespace clothstream::scene {

SceneDefinition::SceneDefinition(model::Scene start, std::optional<std::string> cloths)
    : start_(std::move(start)),
      stability_(start_),
      cloths_(std::make_shared<const std::string>(
          cloths ? std::move(*cloths) : messages::clothsOfDescription(start_).SerializeAsString())),
      accepted_(start_) {}

std::uint32_t SceneDefinition::leastSubsteps(const model::Scene& scene) const {
  const std::uint32_t stable = stability_.substeps(scene);
  return stable == 0 ? start_.substeps : std::min(stable, start_.substeps);
}

void SceneDefinition::change(model::Scene scene) {
  accepted_ = std::move(scene);
  ++version_;
  description_.reset();
}

void SceneDefinition::restore(model::Scene scene) {
  change(std::move(scene));
  // The content ids of the earlier run are not known.
  std::random_device random;
  newestContent_ = (std::uint64_t{random()} << 30) | (std::uint64_t{1} << 62);
}

std::shared_ptr<const delivery::DescriptionChunks> SceneDefinition::describe(std::string rest) {
  return description_ =
             std::make_shared<const delivery::DescriptionChunks>(++newestContent_, cloths_, std::move(rest));
}

}  // namespace clothstream::scene
