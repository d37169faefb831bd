// SPDX-License-Identifier: MIT
// One user in a scene: joins the connection, the input, the panel and the stage that is drawn.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "clients/xr/connection/connection.h"
#include "clients/xr/input/haptics.h"
#include "clients/xr/input/panel_seat.h"
#include "clients/xr/input/placement.h"
#include "clients/xr/input/touch.h"
#include "clients/xr/panel/panel.h"
#include "clients/xr/stage/stage.h"
#include "clients/xr/stage/stage_reader.h"
#include "clients/xr/timing/frame_times.h"

namespace clothstream::xr {

// All functions are called from one thread.
class Visit {
 public:
  // `painter` must outlive the visit.
  Visit(ConnectionOptions options, TextPainter& painter);

  // Makes the stage for a display time. `sample` is for that time, in coordinates of the room.
  void frame(const InputSample& sample, std::uint64_t nowUs, std::uint64_t displayUs);
  // Nothing is displayed: keeps the connection, and removes the user from the scene. Call ten times a second.
  void hidden(std::uint64_t nowUs);

  const Stage& stage() const { return stage_; }
  const Pose& toScene() const { return placement_.toScene(); }
  void setBackground(Background background) { stage_.background = background; }
  // Vibrations that the last frame() caused.
  std::span<const Pulse> pulses() const { return {pulses_.data(), pulseCount_}; }

  // Moves the panel to a pose in the room, for a flat view. Call it before frame().
  void setPanelPose(const Pose& pose) { seat_.sit(pose); }
  // Leaves the panel out of the stage. Call it after frame().
  void hidePanel() { stage_.panel.visible = false; }
  // Whether a press of this side holds the panel or the cloth.
  bool isUsed(Side side) const { return panel_.isHeld(indexOf(side)) || touch_.grabber(side).holds(); }
  // Places scene and panel before the user in the next frame.
  void recenter() { isPlaced_ = false; }
  // Shows a text on the panel for a few seconds.
  void say(std::string_view text, std::uint64_t nowUs);
  // The user has pressed the button for leaving.
  bool leaves() const { return leaves_; }
  // Frames per second of the stream; 0 before the description.
  float streamRate() const { return streamRate_; }
  // Cost of a displayed frame, for the figures.
  void addFrameTime(std::uint64_t nowUs, std::uint64_t cpuUs) { times_.add(nowUs, cpuUs); }
  const FrameTimes& frameTimes() const { return times_; }
  const Connection& connection() const { return connection_; }
  // Leaves the scene, as Connection::leave().
  bool leave() { return connection_.leave(); }

 private:
  void place(const InputSample& sample, const cs_client* client);
  void point(const Touchable* cloth, std::uint64_t nowUs, cs_client* client);
  void act(const PanelAction& action, cs_client* client);
  void readEvents(cs_client* client, std::uint64_t nowUs);
  void readFacts(cs_client* client, std::uint64_t nowUs);
  void showPanel(const InputSample& sample);
  void drawOwn(const cs_client* client);
  void addPulse(const std::optional<Pulse>& pulse);

  Connection connection_;
  StageReader reader_;
  Panel panel_;
  PanelFacts facts_;
  Stage stage_;
  Touch touch_;
  OwnInput sent_;
  InputSender sender_;
  Placement placement_;
  PanelSeat seat_;
  FrameTimes times_;
  std::array<std::optional<PanelHit>, kSides> hits_;
  std::array<Pulse, 8> pulses_{};
  std::size_t pulseCount_ = 0;
  std::uint64_t clientNumber_ = 0, factsUs_ = 0, scenesUs_ = 0, saidUs_ = 0;
  std::uint32_t events_ = 0;
  std::string said_, sceneName_;
  float streamRate_ = 0;
  bool isPlaced_ = false, placedWithScene_ = false, hasTrouble_ = false, leaves_ = false;
};

}  // namespace clothstream::xr
