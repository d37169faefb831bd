// SPDX-License-Identifier: MIT
// Device time and memory that participants may add to what the server started with.
#pragma once

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>

#include "server/messages/field_error.h"
#include "server/model/price.h"
#include "server/model/scene.h"
#include "server/scene/collider_shares.h"

namespace clothstream::scene {

// Memory is counted on device and host together. A load is the price of a scene's ticks in seconds of the
// device's time per second. The default is above 1, because most solvers end long before their last
// iteration, and because a scene that is too slow only slows itself down.
struct BudgetLimits {
  // The first of each pair limits one scene, the second all scenes together.
  double sceneLoad = 4, load = 4;
  double sceneMegabytes = 256, megabytes = 256;
  // Seconds of the device's time that one tick of a scene may take; 0: no limit. A load allows long ticks at
  // a low rate, and a long tick keeps its slices on the device when other scenes need it.
  double tickSeconds = 0.5;
};

// Thread-safe.
class Budget {
 public:
  explicit Budget(const BudgetLimits& limits = {}) : limits_(limits) {}

  // Until the speed is known, time costs nothing.
  void setSpeed(const model::DeviceSpeed& speed);
  model::DeviceSpeed speed() const;

  // Amounts that all charges together use, and amounts that are free; 0 if charges exceed the budget.
  struct Usage {
    double load = 0, freeLoad = 0;
    double megabytes = 0, freeMegabytes = 0;
  };
  Usage usage() const;

 private:
  friend class Charge;

  const BudgetLimits limits_;
  mutable std::mutex mutex_;
  model::DeviceSpeed speed_;
  double load_ = 0, megabytes_ = 0;  // of all charges
};

// Charges one scene to the budget while it lives. Not thread-safe.
class Charge {
 public:
  // `free`: the scene costs nothing as it is now; only changes that make it more expensive are charged.
  Charge(std::shared_ptr<Budget> budget, const model::Scene& scene, bool free);
  ~Charge();
  Charge(const Charge&) = delete;
  Charge& operator=(const Charge&) = delete;

  // Whether the price may be higher than what lets a scene keep its rate, alone on the device. A scene that
  // the server started with may always cost a quarter more than at its start.
  enum class Pace : std::uint8_t { any, inTime };
  // Charges the scene as it will be. If that exceeds the budget, changes nothing and returns an error that
  // names price, budget and what would fit. `path` begins its text. A price that is no higher than before is
  // always allowed.
  messages::Result<void> charge(const std::string& path, const model::Scene& scene, Pace pace = Pace::any);
  // Room for the hands of participants, and for their other colliders next to these hands, as sums of weights
  // (collider_shares.h). Hands only need room in their scene, and always have some: they are no part of the
  // server's load, so that nobody else can use up their room. Other colliders have half of the load that is
  // free, so that the other half is there for those of the next scene, and no more than lets the scene keep
  // its rate. Infinite until the speed is known.
  double roomForHands(const model::Scene& scene) const;
  double roomForOthers(const model::Scene& scene, double hands) const;
  // Charges the scene with these colliders of its participants, also beyond the budget.
  void chargeColliders(const model::Scene& scene, const ColliderLoad& colliders);
  // Charges the scene with participants that move the joints of its colliders, from now on, like charge().
  messages::Result<void> chargeJoints(const std::string& path, const model::Scene& scene);
  // Charges the scene with this number of local winds that participants hold, like charge().
  messages::Result<void> chargeWinds(const std::string& path, const model::Scene& scene, std::size_t count);
  // Charges the scene with the surfaces of the real room of its participants, like charge().
  messages::Result<void> chargeSurfaces(const std::string& path, const model::Scene& scene,
                                        const SurfaceLoad& surfaces);
  // The scene starts again: nobody has moved joints.
  void forgetJoints() { movesJoints_ = false; }
  // Charges the scene with parameters that it had before, also beyond the budget.
  void restore(const model::Scene& scene);
  // Returns whether a free scene would cost more than it did at first. Colliders of participants do not
  // count.
  bool exceedsStart(const model::Scene& scene) const;
  // Gives the charge back. Until the scene is charged again, its colliders and winds cost nothing.
  void release();

  // Price of the scene with the colliders of its participants: seconds of the device's time per second. 0
  // until the speed of the device is known.
  double load(const model::Scene& scene) const;
  // Work of a tick of the charged scene with this number of colliders.
  model::Work work(const model::Scene& scene, std::size_t colliders) const {
    return workWith(scene, static_cast<double>(colliders));
  }

 private:
  struct Amount {
    double load = 0, megabytes = 0;
  };
  model::Work workWith(const model::Scene& scene, double colliders) const;
  Amount priceOf(const model::Scene& scene) const;  // the budget's mutex is held
  // Price of the scene with these colliders of participants, in seconds of the device's time a second. The
  // budget's mutex is held.
  double secondsOf(const model::Scene& scene, double colliders) const;
  // The part of it that is free. The budget's mutex is held.
  double startSeconds(const model::Scene& scene) const;
  // Load that the scene adds to what it is free of, with these colliders of participants; negative if it is
  // cheaper. The budget's mutex is held.
  double loadWith(const model::Scene& scene, double colliders) const;
  // Largest load that the scene may have by its own limits.
  double mostLoad(const model::Scene& scene) const;
  // A load that the scene may have, and the limit that it follows from. The budget's mutex is held.
  struct Room {
    double load = 0;
    bool tick = false;  // the limit of a tick is below the others
    double free = 0;    // load that all scenes together leave
  };
  Room roomFor(const model::Scene& scene) const;
  // Says what the load is, what it may be and by which option.
  std::string excessOf(const model::Scene& scene, double load, const Room& room) const;
  void replace(const Amount& next);  // the budget's mutex is held

  const std::shared_ptr<Budget> budget_;
  const model::PriceModel model_;
  ColliderLoad colliders_;  // of participants
  bool movesJoints_ = false;
  std::size_t heldWinds_ = 0;  // of participants
  SurfaceLoad surfaces_;       // of participants
  model::Work freeWork_;
  double freeMegabytes_ = 0;
  Amount charged_;
  bool released_ = false;  // and not charged again since
  bool made_;              // the scene exists: its shape and substeps stay
};

}  // namespace clothstream::scene
