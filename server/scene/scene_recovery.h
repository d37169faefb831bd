// SPDX-License-Identifier: MIT
// Recovery of a scene from states that are not valid, and the parameters to which it can go back.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "server/model/scene.h"
#include "server/scene/journal.h"
#include "server/scene/recovery_policy.h"
#include "server/schedule/clock.h"
#include "server/schedule/token_bucket.h"

namespace clothstream::scene {

using schedule::Clock;

// Bounds the loss. Every second of healthy ticks a checkpoint is due on the device; an unhealthy state goes
// back to it. Every five seconds a snapshot is due on the CPU; after a device loss the scene continues from
// it. RecoveryPolicy chooses what else an unhealthy state costs.
//
// Chooses, but does nothing: it knows no device. Ticks are numbers that only grow. Not thread-safe.
class SceneRecovery {
 public:
  using Cure = RecoveryPolicy::Cure;

  static constexpr std::uint32_t kCheckpointSeconds = 1, kSnapshotSeconds = 5;

  // Parameters, without eased corrections.
  struct Parameters {
    model::Environment environment;
    std::vector<model::Cloth> cloths;
  };

  // The parameters of `start` are proven.
  explicit SceneRecovery(const model::Scene& start);
  // Continues a scene whose newest unhealthy tick is this one.
  void restore(std::optional<std::uint64_t> newestFailure) { policy_.restore(newestFailure); }
  std::optional<std::uint64_t> newestFailure() const { return policy_.newest(); }

  // Recovery of the state before the next tick. If there is one, the present state will be replaced.
  Recovery next() const { return next_; }
  // The next tick begins with this recovery; the one after it needs none.
  Recovery take() { return std::exchange(next_, Recovery::none); }
  // The cloths go back to their start, because a participant wants it.
  void reset();
  // The scene continues on another device from its newest snapshot.
  void rebuilt();

  // Returns whether the present state is that of a healthy tick.
  bool isHealthy() const { return healthyTicks_ > 0; }
  // Returns whether the next tick should keep the state before it on the device.
  bool checkpointDue() const { return isDue(kCheckpointSeconds); }
  // Returns whether the next tick should end with a snapshot.
  bool snapshotDue() const { return isDue(kSnapshotSeconds); }

  // `scene` has other parameters since `tick`.
  void changed(std::uint64_t tick, const model::Scene& scene);
  // The state of `tick` is healthy; the tick had the parameters of `scene`.
  void healthy(std::uint64_t tick, const model::Scene& scene);
  // The state of `tick` is not healthy: sets next(). The caller does what else the cure says. `touched`:
  // participants act on the cloth.
  Cure unhealthy(std::uint64_t tick, bool touched);

  // Parameters that Cure::resetAndUndo goes back to.
  const Parameters& proven() const { return proven_; }
  // Returns whether what participants do has no effect in the tick after `tick`.
  bool ignoresParticipants(std::uint64_t tick) const { return policy_.ignores(tick); }

  // Returns whether participants are informed of a recovery now. Limits how often they are.
  bool takeNotice(Clock::time_point now) { return notices_.take(now); }
  // Rest of the notice, after the reason.
  static std::string_view describe(Cure cure);

 private:
  bool isDue(std::uint32_t seconds) const { return isHealthy() && healthyTicks_ % (seconds * second_) == 0; }

  const std::uint64_t second_;  // ticks
  RecoveryPolicy policy_;
  Parameters proven_, candidate_;  // as the policy has them
  Recovery next_ = Recovery::none;
  std::uint64_t healthyTicks_ = 0;  // since the start or the newest recovery
  schedule::TokenBucket notices_{1, 5};
};

}  // namespace clothstream::scene
