// SPDX-License-Identifier: MIT
// What a scene tells of itself as it happens, to whoever writes it down.
#pragma once

#include <cstdint>
#include <string>

#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"
#include "server/model/scene.h"
#include "server/simulation/cloth_simulation.h"
#include "server/stream/collider_set.h"
#include "server/stream/envelope.h"
#include "server/vulkan/device.h"

namespace clothstream::stream {

// What a tick does to the state before it: back to the newest that the device kept, or to the start.
enum class Recovery : std::uint8_t { none, rollback, reset };

// A complete tick: all that the device was given for it, and what it said of the outcome. Until the next.
struct AppliedTick {
  std::uint64_t tick = 0;
  simulation::TickStatus status{};
  Recovery recovery = Recovery::none;
  bool keepsState = false;     // the device kept the state before it
  bool clothsChanged = false;  // some parameter of a cloth is not as in the tick before
  const model::Scene& scene;   // with the parameters of this tick
  const simulation::TickInputs& inputs;
  const ColliderSet& colliders;  // of which the inputs' are
};

// No function of it waits, or throws.
class Journal {
 public:
  virtual ~Journal() = default;

  // Whether it goes on: then no frame is to be far from a key frame. Any thread.
  virtual bool active() const = 0;
  // Whether begin() is to be called before the next tick. Any thread.
  virtual bool due() const = 0;
  // Somebody asks for a recording under this name (empty: any), or that it ends; gives its file's name. Not
  // of the device's thread, for it may wait for a disk. Where nobody can ask, both say so.
  [[nodiscard]] virtual messages::Result<std::string> start(const std::string& name);
  [[nodiscard]] virtual messages::Result<v1::StopRecordingResponse> stop();

  // The device's thread. When it is due: the scene as it is before the next tick, what describes its stream,
  // its state, and the state that a reset goes back to.
  virtual void begin(const vulkan::DeviceInfo& device, const model::Scene& scene,
                     const v1::StreamDescription& description, const simulation::StateSnapshot& state,
                     const simulation::StateSnapshot& start) = 0;
  virtual void ticked(const AppliedTick& tick) = 0;
  // The state after the tick that was told last. `grabsHold`: some grab holds cloth, and the device alone
  // knows which.
  virtual void saved(const simulation::StateSnapshot& state, bool grabsHold) = 0;
  // From here on the simulation is another one: it goes on after `tick` from this state.
  virtual void restored(std::uint64_t tick, const simulation::StateSnapshot& state) = 0;
  // The simulation is gone. Another one may begin at the scene's start.
  virtual void end() = 0;

  // Any thread. A serialised ServerMessage for everybody in the scene.
  virtual void sent(const SharedBytes& message) = 0;
  virtual void joined(std::uint64_t participant, const std::string& clientName,
                      const std::string& displayName) = 0;
  virtual void left(std::uint64_t participant) = 0;
};

// Why a scene that nothing keeps a journal of is not recorded.
inline messages::FieldError recordsNothing() {
  return {v1::ERROR_CODE_INVALID_ARGUMENT,
          "startRecording: this server writes no recordings for who asks: it was not told where to "
          "(clothstream-server --recordings DIR)"};
}
inline messages::Result<std::string> Journal::start(const std::string&) {
  return tl::unexpected(recordsNothing());
}
inline messages::Result<v1::StopRecordingResponse> Journal::stop() {
  return tl::unexpected(recordsNothing());
}

// Tells that a scene is recorded.
inline SharedBytes recordedNotice(std::uint64_t tick) {
  return notice(v1::NOTICE_KIND_RECORDING_STARTED, "the scene is being recorded", tick);
}

}  // namespace clothstream::stream
