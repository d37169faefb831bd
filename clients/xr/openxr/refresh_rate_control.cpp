// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/refresh_rate_control.h"

#include <spdlog/spdlog.h>

#include "clients/xr/timing/refresh_rate.h"

namespace clothstream::xr {

RefreshRateControl::RefreshRateControl(const Instance& instance, XrSession session, float wanted)
    : session_(session), wanted_(wanted) {
  if (!instance.extensions().refreshRate) return;
  get_ = functionOf<PFN_xrGetDisplayRefreshRateFB>(instance.get(), "xrGetDisplayRefreshRateFB");
  request_ = functionOf<PFN_xrRequestDisplayRefreshRateFB>(instance.get(), "xrRequestDisplayRefreshRateFB");
  const auto enumerate =
      functionOf<PFN_xrEnumerateDisplayRefreshRatesFB>(instance.get(), "xrEnumerateDisplayRefreshRatesFB");
  std::uint32_t count = 0;
  XrResult result = enumerate(session, 0, &count, nullptr);
  offered_.resize(count);
  if (XR_SUCCEEDED(result)) result = enumerate(session, count, &count, offered_.data());
  if (XR_SUCCEEDED(result)) return;
  offered_.clear();
  spdlog::warn("The runtime does not say which refresh rates the headset has: {}", nameOf(result));
}

void RefreshRateControl::suit(float streamRate) {
  if (offered_.empty() || streamRate == streamRate_) return;
  streamRate_ = streamRate;
  float current = 0;
  if (const XrResult result = get_(session_, &current); XR_FAILED(result))
    return spdlog::warn("The runtime does not say the refresh rate of the headset: {}", nameOf(result));
  const float chosen = chooseRefreshRate(offered_, wanted_, streamRate, current);
  if (chosen <= 0 || chosen == current) return;
  const XrResult result = request_(session_, chosen);
  if (XR_SUCCEEDED(result)) {
    spdlog::info("The headset is asked for {} Hz instead of {} Hz", chosen, current);
  } else {
    spdlog::warn("The headset refuses {} Hz: {}", chosen, nameOf(result));
  }
}

}  // namespace clothstream::xr
