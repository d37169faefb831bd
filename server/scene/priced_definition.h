// SPDX-License-Identifier: MIT
// Definition of a scene, which participants change, and what it costs.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "clothstream/v1/session.pb.h"
#include "server/delivery/description_chunks.h"
#include "server/messages/field_error.h"
#include "server/model/price.h"
#include "server/model/scene.h"
#include "server/scene/budget.h"
#include "server/scene/change_limits.h"
#include "server/scene/collider_shares.h"
#include "server/scene/inbox.h"
#include "server/scene/scene_definition.h"

namespace clothstream::scene {

// Thread-safe. Price and definition change together: who sees a change sees its price.
class PricedDefinition : public ColliderBudget {
 public:
  // `free`: the start costs nothing, only changes that make it more expensive are charged to `budget`. A null
  // `budget` means a separate one. `cloths`: see SceneDefinition.
  PricedDefinition(model::Scene start, std::shared_ptr<Budget> budget, bool free,
                   std::optional<std::string> cloths = {});

  // Neither ever changes.
  const model::Scene& start() const { return definition_.start(); }
  const model::StabilityBound& stability() const { return definition_.stability(); }
  // See SceneDefinition.
  std::uint32_t leastSubsteps(const model::Scene& scene) const { return definition_.leastSubsteps(scene); }
  model::Scene accepted() const;
  std::uint64_t version() const;
  // Description of accepted(). `message` makes it when it is asked for first after a change; its cloths are
  // ignored.
  std::shared_ptr<const delivery::DescriptionChunks> description(
      const std::function<v1::StreamDescription(const model::Scene& accepted)>& message);

  // Puts a change of this participant into the inbox, or returns what is wrong with it.
  messages::Result<void> change(std::uint64_t participant, const v1::ParameterChange& message,
                                Charge::Pace pace, Inbox& inbox);
  // Counts a change by this participant, 0 for peers outside of the scene, or returns why there are too many
  // (ChangeLimits). `call` begins the text.
  messages::Result<void> countChange(std::uint64_t participant, const char* call);
  // Sets the definition to the start, and drops the changes that wait in the inbox.
  void restart(Inbox& inbox);
  // Sets the definition to `applied` plus the changes that wait in the inbox.
  void revertTo(const model::Scene& applied, Inbox& inbox);
  // Continues from a definition of an earlier run; without one, from the start.
  void restore(std::optional<model::Scene> definition);

  // Charges the definition, or returns why it exceeds the budget. `path` begins the text; without it the text
  // begins with a verb, as in "would take".
  messages::Result<void> charge(const std::string& path);
  // Gives the charge back.
  void release();
  // Whether participants have made it more expensive than it was at its start.
  bool isDearer() const { return isDearer_; }
  // Price of a tick of accepted() with this number of colliders.
  model::Work tickWork(std::size_t colliders) const;
  // Price of the scene as it is: seconds of the device's time per second, by estimate.
  double price() const;

  // Place of the cloth after a tick.
  void setClothBounds(const ClothBounds& bounds);

  double roomForHands() const override;
  double roomForOthers(double hands) const override;
  messages::Result<void> chargeJoints() override;
  messages::Result<void> chargeWinds(std::size_t count) override;
  messages::Result<void> chargeSurfaces(const SurfaceLoad& load) override;
  void chargeColliders(const ColliderLoad& load) override;
  bool boundsOfCloth(ClothBounds& bounds) const override;

 private:
  // The callers of these hold the lock. tooMany() returns the error for what ChangeLimits has counted.
  messages::Result<void> countChangeLocked(std::uint64_t participant, const char* call);
  messages::Result<void> tooMany(ChangeLimits::Exceeded exceeded, const char* call, const char* what) const;
  void accept(model::Scene scene);  // beyond the budget, too
  void comparePrice() { isDearer_ = charge_.exceedsStart(definition_.accepted()); }

  mutable std::mutex mutex_;
  SceneDefinition definition_;
  const bool isFree_;
  Charge charge_;                      // of definition_.accepted()
  std::atomic<bool> isDearer_{false};  // that costs more than start()
  ChangeLimits changes_;

  mutable std::mutex boundsMutex_;
  std::optional<ClothBounds> clothBounds_;  // after the newest tick
};

}  // namespace clothstream::scene
