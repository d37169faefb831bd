// SPDX-License-Identifier: MIT
// Interface of a scene's journal, which recordings implement.
#pragma once

#include <cstdint>
#include <string>

#include "server/delivery/envelope.h"
#include "server/messages/field_error.h"
#include "server/model/scene.h"
#include "server/scene/collider_set.h"
#include "server/simulation/cloth_simulation.h"
#include "server/vulkan/device.h"

namespace clothstream::scene {

// Recovery of the state before a tick: none, back to the newest checkpoint on the device, or back to
// the scene's start.
enum class Recovery : std::uint8_t { none, rollback, reset };

// A complete tick: all inputs of the device, and the outcome. Valid until the next tick.
struct AppliedTick {
  std::uint64_t tick = 0;
  simulation::TickStatus status{};
  Recovery recovery = Recovery::none;
  bool keepsState = false;     // the device kept a checkpoint of the state before the tick
  bool clothsChanged = false;  // a parameter of a cloth differs from the tick before
  std::uint32_t substeps = 0;  // of this tick; fewer than those of the scene if the device is overloaded
  const model::Scene& scene;   // with this tick's parameters
  const simulation::TickInputs& inputs;
  const ColliderSet& colliders;  // identities of the colliders in `inputs`
};

// No function blocks or throws, except where noted.
class Journal {
 public:
  virtual ~Journal() = default;

  // Returns whether a recording is running; key frames are then frequent. Any thread.
  virtual bool active() const = 0;
  // Returns whether begin() is to be called before the next tick. Any thread.
  virtual bool due() const = 0;
  // start() starts a recording with this name (empty: any name) and returns the name of its file. stop() ends
  // it. Both may block on a disk, so they must not be called on the device's thread. By default both return
  // an error.
  [[nodiscard]] virtual messages::Result<std::string> start(const std::string& name);
  [[nodiscard]] virtual messages::Result<v1::StopRecordingResponse> stop();

  // The following five belong to the device's thread.
  // Called when due: the scene before the next tick, the description of its stream, its state, and the state
  // that a reset returns to. Both states are one object if the scene is at its start.
  virtual void begin(const vulkan::DeviceInfo& device, const model::Scene& scene,
                     const v1::StreamDescription& description, const simulation::StateSnapshot& state,
                     const simulation::StateSnapshot& start) = 0;
  virtual void ticked(const AppliedTick& tick) = 0;
  // State after the newest ticked().
  virtual void saved(const simulation::StateSnapshot& state) = 0;
  // The simulation was replaced: it continues after `tick` from this state.
  virtual void restored(std::uint64_t tick, const simulation::StateSnapshot& state) = 0;
  // The simulation ended. Another one may begin at the scene's start.
  virtual void end() = 0;

  // The following belong to any thread. sent() gets each message that is sent to all subscribers.
  virtual void sent(const delivery::SharedBytes& message) = 0;
  virtual void joined(std::uint64_t participant, const std::string& clientName,
                      const std::string& displayName) = 0;
  virtual void left(std::uint64_t participant) = 0;
};

// Error for a request, such as "startRecording", that needs the journal of a scene that has none.
messages::FieldError noJournalError(const std::string& call);

// Notice that a scene is being recorded.
delivery::SharedBytes recordingNotice(std::uint64_t tick);

}  // namespace clothstream::scene
