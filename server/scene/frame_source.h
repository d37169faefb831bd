// SPDX-License-Identifier: MIT
// Source of a scene's frames that is not a simulation of this server: a recording that is played, or another
// server.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/delivery/envelope.h"
#include "server/messages/field_error.h"
#include "server/scene/remote_session.h"

namespace clothstream::scene {

class LiveScene;

// Thread-safe.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // Description of the stream. Constant.
  virtual const v1::StreamDescription& description() const = 0;
  // Name of the device that simulated the frames.
  virtual std::string deviceName() const = 0;

  // Number of qualities of each frame. 1 means a single quality, which may have any number. Constant.
  virtual std::uint8_t qualities() const { return 1; }
  // Whether everyone in the scene who has no session with another server is a viewer. Constant.
  virtual bool onlyViewed() const { return false; }
  // Opens a session with the server that simulates the scene, for a peer that wants to take part. Null: there
  // is none, or it has no room. `wake` is called, from any thread, when the session has something for the
  // peer or has ended; it must not block.
  virtual std::shared_ptr<RemoteSession> connect(const RemotePeer& peer, std::function<void()> wake);
  // Why participants cannot change parameters: the end of a sentence that begins with the scene. Constant.
  virtual std::string whyFixed() const = 0;

  // Whether the next frame waits until all subscribers have acknowledged the last one. Constant.
  virtual bool inLockstep() const { return false; }

  // Publishes to the scene's subscribers from now until end() has returned. Called once.
  virtual void begin(LiveScene& scene) = 0;
  virtual void end() = 0;
  // A subscriber joined or left, or the scene was paused or resumed. In lockstep also: a subscriber has
  // acknowledged what it was sent.
  virtual void wake() = 0;

  // Checks the whole request, and applies its seek, speed, loop and reset: all of them, or none and an error.
  [[nodiscard]] virtual messages::Result<void> control(const v1::ControlSceneRequest& request) = 0;
  // Present position and settings of a recording; nothing for other sources.
  virtual std::optional<v1::Playback> playback() const = 0;
  // Parameters in force at the present position; empty if none are known.
  virtual v1::ParameterChange parameters() const = 0;
};

// Message with the source's position and settings; null for a source without them.
delivery::SharedBytes playbackMessage(const FrameSource& source);

// Message with the parameters in force at the present position; null if none are known.
delivery::SharedBytes parametersMessage(const FrameSource& source, std::uint64_t tick);

}  // namespace clothstream::scene
