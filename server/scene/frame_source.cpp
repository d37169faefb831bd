// SPDX-License-Identifier: MIT
#include "server/scene/frame_source.h"

#include <utility>

#include "clothstream/v1/session.pb.h"

namespace clothstream::scene {

std::shared_ptr<RemoteSession> FrameSource::connect(const RemotePeer& /*peer*/,
                                                    std::function<void()> /*wake*/) {
  return nullptr;
}

delivery::SharedBytes playbackMessage(const FrameSource& source) {
  std::optional<v1::Playback> playback = source.playback();
  if (!playback) return nullptr;
  v1::ServerMessage message;
  *message.mutable_playback() = std::move(*playback);
  return delivery::serialise(message);
}

delivery::SharedBytes parametersMessage(const FrameSource& source, std::uint64_t tick) {
  v1::ParameterChange parameters = source.parameters();
  return parameters.ByteSizeLong() == 0 ? nullptr : delivery::parametersChanged(std::move(parameters), tick);
}

}  // namespace clothstream::scene
