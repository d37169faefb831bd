// SPDX-License-Identifier: MIT
// Shows a visit in a headset: one runtime, one session, its frames.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "clients/xr/openxr/actions.h"
#include "clients/xr/openxr/eye_pictures.h"
#include "clients/xr/openxr/foveation.h"
#include "clients/xr/openxr/graphics.h"
#include "clients/xr/openxr/hand_trackers.h"
#include "clients/xr/openxr/instance.h"
#include "clients/xr/openxr/pass_through.h"
#include "clients/xr/openxr/refresh_rate_control.h"
#include "clients/xr/openxr/room_space.h"
#include "clients/xr/openxr/session.h"
#include "clients/xr/openxr/swapchain.h"
#include "clients/xr/render/frame_commands.h"
#include "clients/xr/render/renderer.h"
#include "clients/xr/timing/display_clock.h"
#include "clients/xr/visit/visit.h"

namespace clothstream::xr {

struct HeadsetOptions {
  FoveationLevel foveation = FoveationLevel::kLow;
  bool passThrough = false;   // show the real room where the headset can
  float refreshRate = 0;      // Hz; 0 means one that suits the stream
  std::uint32_t samples = 4;  // per pixel: 1, 2, 4 or 8
  ShadowDetail shadows = ShadowDetail::kFull;
  float scale = 1;                  // of the edges of pictures, relative to what the runtime recommends
  std::string eyePictures;          // folder; "" means none
  std::uint32_t pictureEvery = 90;  // displayed frames between eye pictures
};

enum class HeadsetStep { runs, restarts, exits };

class Headset {
 public:
  // Throws an XrError or a std::runtime_error that says what is missing. `visit` must outlive the headset.
  Headset(const HeadsetOptions& options, Visit& visit);
  ~Headset();
  Headset(const Headset&) = delete;
  Headset& operator=(const Headset&) = delete;

  // One displayed frame, or a short wait without one. Throws an XrError if the runtime is lost.
  HeadsetStep step();
  // Asks the runtime to end the session, of which step() tells. Returns false if nothing follows.
  bool requestExit() { return session_.requestExit(); }

 private:
  struct Layers;

  void makePictures();
  void makeColour(VkFormat format, VkExtent2D size);
  void frame();
  // Follows changes of spaces that hold at this display time.
  void moveRoom(XrTime time);
  bool locateViews(XrTime time);
  void draw();
  void end(const XrFrameState& state, bool isDrawn);
  std::uint64_t displayUs(const XrFrameState& state, std::uint64_t nowUs);

  HeadsetOptions options_;
  Visit& visit_;
  Instance instance_;
  Graphics graphics_;
  Session session_;
  RoomSpace room_;
  Actions actions_;
  HandTrackers hands_;
  RefreshRateControl refreshRate_;
  Blending blending_;
  std::unique_ptr<PassThroughLayer> passThrough_;
  std::unique_ptr<Swapchain> colour_, depth_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<EyePictures> pictures_;
  std::unique_ptr<FrameCommands> commands_;
  DisplayClock clock_;
  PFN_xrConvertTimeToTimespecTimeKHR convertTime_ = nullptr;
  InputSample sample_;
  std::array<XrView, 2> eyes_{};
  std::array<View, 2> views_{};
  std::array<XrCompositionLayerProjectionView, 2> shown_{};
  std::array<XrCompositionLayerDepthInfoKHR, 2> shownDepth_{};
  std::uint64_t topology_ = 0, frames_ = 0;
  std::optional<XrTime> originMoves_, floorMoves_;  // as in SessionChanges
  bool recenters_ = false;                          // in the next frame that is drawn
};

}  // namespace clothstream::xr
