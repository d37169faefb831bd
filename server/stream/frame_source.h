// SPDX-License-Identifier: MIT
// What publishes the frames of a scene that is not simulated here.
#pragma once

#include <string>

#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"
#include "server/stream/envelope.h"

namespace clothstream::stream {

class LiveScene;

// Thread-safe.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // Of all its frames; the same as long as it is there.
  virtual const v1::StreamDescription& description() const = 0;
  // What the frames were simulated on.
  virtual std::string deviceName() const = 0;

  // From here on, until end() has returned, it publishes to the scene's audience. Once.
  virtual void begin(LiveScene& scene) = 0;
  virtual void end() = 0;
  // Somebody joined or left, or the scene's clock was stopped or goes on.
  virtual void wake() = 0;

  // What the request asks for beside pauses, all of it or nothing.
  [[nodiscard]] virtual messages::Result<void> control(const v1::ControlSceneRequest& request) = 0;
  // Where it stands.
  virtual v1::Playback playback() const = 0;
  // Those that hold there; nothing where none are known.
  virtual v1::ParameterChange parameters() const = 0;
};

// Tells where it stands.
inline SharedBytes playbackMessage(const FrameSource& source) {
  v1::ServerMessage message;
  *message.mutable_playback() = source.playback();
  return serialise(message);
}

// Tells the parameters that hold there; nullptr where none are known.
inline SharedBytes parametersMessage(const FrameSource& source, std::uint64_t tick) {
  v1::ParameterChange parameters = source.parameters();
  return parameters.ByteSizeLong() == 0 ? nullptr : parametersChanged(std::move(parameters), tick);
}

}  // namespace clothstream::stream
