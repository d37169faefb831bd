// SPDX-License-Identifier: MIT
#include "clients/xr/timing/refresh_rate.h"

#include <algorithm>
#include <cmath>

namespace clothstream::xr {

float chooseRefreshRate(std::span<const float> offered, float wanted, float streamRate, float current) {
  if (offered.empty()) return 0;
  if (wanted > 0)
    return *std::ranges::min_element(offered, {}, [&](float rate) { return std::abs(rate - wanted); });
  constexpr float kLeast = 71.5f, kSameRate = 0.5f;  // Hz
  float best = 0;
  for (const float rate : offered) {
    if (rate < kLeast || streamRate <= 0) continue;
    const float nearest = std::round(rate / streamRate) * streamRate;
    if (std::abs(rate - nearest) < kSameRate && (best == 0 || rate < best)) best = rate;
  }
  return best > 0 ? best : current;
}

}  // namespace clothstream::xr
