// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/foveation.h"

#include <array>
#include <cstddef>

namespace clothstream::xr {

void foveate(const Instance& instance, XrSession session, XrSwapchain swapchain, FoveationLevel level) {
  const auto create =
      functionOf<PFN_xrCreateFoveationProfileFB>(instance.get(), "xrCreateFoveationProfileFB");
  const auto destroy =
      functionOf<PFN_xrDestroyFoveationProfileFB>(instance.get(), "xrDestroyFoveationProfileFB");
  const auto update = functionOf<PFN_xrUpdateSwapchainFB>(instance.get(), "xrUpdateSwapchainFB");
  constexpr std::array kLevels{XR_FOVEATION_LEVEL_NONE_FB, XR_FOVEATION_LEVEL_LOW_FB,
                               XR_FOVEATION_LEVEL_MEDIUM_FB, XR_FOVEATION_LEVEL_HIGH_FB};
  auto wanted = typed<XrFoveationLevelProfileCreateInfoFB>(XR_TYPE_FOVEATION_LEVEL_PROFILE_CREATE_INFO_FB);
  wanted.level = kLevels[static_cast<std::size_t>(level)];
  wanted.dynamic = XR_FOVEATION_DYNAMIC_DISABLED_FB;
  auto info = typed<XrFoveationProfileCreateInfoFB>(XR_TYPE_FOVEATION_PROFILE_CREATE_INFO_FB);
  info.next = &wanted;
  auto state = typed<XrSwapchainStateFoveationFB>(XR_TYPE_SWAPCHAIN_STATE_FOVEATION_FB);
  check(create(session, &info, &state.profile), "xrCreateFoveationProfileFB");
  const XrResult result = update(swapchain, reinterpret_cast<const XrSwapchainStateBaseHeaderFB*>(&state));
  destroy(state.profile);
  check(result, "xrUpdateSwapchainFB");
}

}  // namespace clothstream::xr
