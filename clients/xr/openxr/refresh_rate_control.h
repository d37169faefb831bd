// SPDX-License-Identifier: MIT
// Refresh rate of the headset (XR_FB_display_refresh_rate).
#pragma once

#include <vector>

#include "clients/xr/openxr/instance.h"

namespace clothstream::xr {

class RefreshRateControl {
 public:
  // Without the extension it does nothing. `wanted`: Hz; 0 means one that suits the stream.
  RefreshRateControl(const Instance& instance, XrSession session, float wanted);

  // Asks the runtime for the rate that suits a stream, in Hz. Does nothing if the rate of the stream is the
  // same as in the last call. A refusal is logged.
  void suit(float streamRate);

 private:
  XrSession session_;
  float wanted_, streamRate_ = -1;
  PFN_xrGetDisplayRefreshRateFB get_ = nullptr;
  PFN_xrRequestDisplayRefreshRateFB request_ = nullptr;
  std::vector<float> offered_;
};

}  // namespace clothstream::xr
