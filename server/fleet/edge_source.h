// SPDX-License-Identifier: MIT
// A scene of another server as the frame source of a scene on an edge.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clothstream/v1/fleet.pb.h"
#include "proto/codec/packet_header.h"
#include "server/delivery/published_frame.h"
#include "server/recording/parameters_in_force.h"
#include "server/scene/frame_source.h"

namespace clothstream::fleet {

// Frames and events from NATS are checked and passed on as they are. Thread-safe.
//
// The newest key frame of each quality, and the frames since, are kept while there are at most
// HeldFrames::kMax: a viewer that joins gets them, and the origin encodes no other key frame for it.
class EdgeSource final : public scene::FrameSource {
 public:
  // Opens a session with the origin, or returns null if it has no room.
  using Connect = std::function<std::shared_ptr<scene::RemoteSession>(const scene::RemotePeer& peer,
                                                                      std::function<void()> wake)>;

  // `wake` is called when the viewers may need something else, until the return of end(). It must not block.
  // `connect` may be called for as long as the source exists.
  EdgeSource(const v1::OfferedScene& offered, v1::StreamDescription description, std::function<void()> wake,
             Connect connect = {});

  const v1::StreamDescription& description() const override { return description_; }
  std::string deviceName() const override { return deviceName_; }
  std::uint8_t qualities() const override { return qualities_; }
  bool onlyViewed() const override { return true; }
  std::string whyFixed() const override { return "is simulated by another server, and is only shown here"; }
  std::shared_ptr<scene::RemoteSession> connect(const scene::RemotePeer& peer,
                                                std::function<void()> wake) override;
  void begin(scene::LiveScene& scene) override;
  void end() override;
  void wake() override;
  messages::Result<void> control(const v1::ControlSceneRequest& request) override;
  std::optional<v1::Playback> playback() const override;
  v1::ParameterChange parameters() const override;

  // Passes a serialised ServerMessage on to the viewers. Returns false if it is not one that belongs here.
  bool receiveFrame(std::span<const std::byte> message);
  bool receiveEvent(std::span<const std::byte> message);
  // Parameters and pause as the origin has them now, after events may have been lost.
  void setParameters(const v1::StreamDescription& description);
  void setPaused(bool paused);
  // Newest tick of all qualities; nothing before the first frame.
  std::optional<std::uint64_t> newest() const;
  // Frames may be missing from now on, so that none of the kept ones may be given to a viewer.
  void forgetFrames();
  // Gives kept frames to viewers that wait for them. Returns what the viewers need from the origin.
  delivery::RequestedFrames needs(delivery::Clock::time_point now);

 private:
  using Clock = delivery::Clock;

  // Index of the quality in the following arrays.
  std::size_t indexOf(std::uint8_t quality) const { return qualities_ > 1 ? quality : 0; }
  bool belongsHere(const codec::PacketHeader& header) const;
  void keep(const delivery::PublishedFrame& frame);

  const v1::StreamDescription description_;
  const std::string deviceName_;
  const std::uint8_t qualities_;
  const std::function<void()> wake_;
  const Connect connect_;

  mutable std::mutex mutex_;  // protects all below; held while frames are published
  scene::LiveScene* scene_ = nullptr;
  std::optional<v1::Playback> playback_;
  recording::ParametersInForce parameters_;
  std::array<std::optional<std::uint64_t>, codec::kMaxQualities> newest_;             // tick
  std::array<std::vector<delivery::PublishedFrame>, codec::kMaxQualities> sinceKey_;  // empty: not kept
  Clock::time_point newestTime_{};
};

}  // namespace clothstream::fleet
