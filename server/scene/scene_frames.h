// SPDX-License-Identifier: MIT
// Frames of a simulated scene, from the recording of a tick to the publisher.
#pragma once

#include <cstdint>

#include "server/delivery/frame_publisher.h"
#include "server/model/scene.h"
#include "server/scene/frame_schedule.h"
#include "server/scene/interaction.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_on_device.h"
#include "server/simulation/state_snapshot.h"

namespace clothstream::scene {

// Belongs to the device's thread.
class SceneFrames {
 public:
  // Both must outlive this object, whose end waits until its frames are published. With `reportRate` 0 no
  // frame carries a report.
  SceneFrames(LiveScene& live, delivery::FramePublisher& publisher, double reportRate);

  // Records the frame of `tick`, whose end is recorded, if it has one: in the qualities that subscribers
  // request and whose encoders have a free slot. `scene` and `interaction` are those of the tick.
  void record(SceneOnDevice& on, std::uint64_t tick, const model::Scene& scene, Interaction& interaction,
              Clock::time_point now);
  // Hands the frame of that tick to the publisher, if it has one. The tick is complete since `done`, with
  // this status. The device needed `seconds` for it without the report.
  void publish(const SceneOnDevice& on, const simulation::TickStatus& status, double seconds,
               Clock::time_point done);

  // Encodes the state after `tick`, the newest and complete one, as a key frame for subscribers that need one
  // to continue. Other subscribers get nothing. Throws vulkan::DeviceLost.
  void encodePaused(SceneOnDevice& on, std::uint64_t tick, const model::Scene& scene,
                    const Interaction& interaction, Clock::time_point now);

  // Returns when every frame is published. The encoders are not used after that.
  void drain() { queue_.drain(); }

  // As in FrameSchedule.
  void owe() { schedule_.owe(); }
  bool owes() const { return schedule_.owes(); }
  void beginRecording() { schedule_.beginRecording(); }

 private:
  // Chooses the encoders of the current frame.
  void chooseEncoders(SceneOnDevice& on, Clock::time_point now);
  // Sets the fields of the current frame, except its report and state hash.
  void describe(const model::Scene& scene, const Interaction& interaction, Clock::time_point start);
  void writeReport(const SceneOnDevice& on, double seconds);

  LiveScene& live_;
  delivery::FramePublisher::Queue queue_;
  FrameSchedule schedule_;
  delivery::CompleteFrame frame_;
  bool hasFrame_ = false;   // the current tick
  bool hasReport_ = false;  // the current frame
};

}  // namespace clothstream::scene
