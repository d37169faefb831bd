// SPDX-License-Identifier: MIT
#include "clients/xr/openxr/pass_through.h"

#include <algorithm>

namespace clothstream::xr {

Blending chooseBlending(std::span<const XrEnvironmentBlendMode> modes, bool hasLayer, bool wantsRoom) {
  const auto has = [&](XrEnvironmentBlendMode mode) { return std::ranges::find(modes, mode) != modes.end(); };
  const bool isOpaque = has(XR_ENVIRONMENT_BLEND_MODE_OPAQUE);
  if (wantsRoom && has(XR_ENVIRONMENT_BLEND_MODE_ALPHA_BLEND))
    return {XR_ENVIRONMENT_BLEND_MODE_ALPHA_BLEND, false, Background::kTransparent};
  if (wantsRoom && hasLayer && isOpaque)
    return {XR_ENVIRONMENT_BLEND_MODE_OPAQUE, true, Background::kTransparent};
  if (has(XR_ENVIRONMENT_BLEND_MODE_ADDITIVE) && (wantsRoom || !isOpaque))
    return {XR_ENVIRONMENT_BLEND_MODE_ADDITIVE, false, Background::kAdditive};
  if (isOpaque || modes.empty()) return {};
  return {modes.front(), false, Background::kRoom};
}

PassThroughLayer::PassThroughLayer(const Instance& instance, XrSession session) {
  destroy_ = functionOf<PFN_xrDestroyPassthroughFB>(instance.get(), "xrDestroyPassthroughFB");
  destroyLayer_ = functionOf<PFN_xrDestroyPassthroughLayerFB>(instance.get(), "xrDestroyPassthroughLayerFB");
  auto info = typed<XrPassthroughCreateInfoFB>(XR_TYPE_PASSTHROUGH_CREATE_INFO_FB);
  info.flags = XR_PASSTHROUGH_IS_RUNNING_AT_CREATION_BIT_FB;
  check(functionOf<PFN_xrCreatePassthroughFB>(instance.get(), "xrCreatePassthroughFB")(session, &info,
                                                                                       &passThrough_),
        "xrCreatePassthroughFB");
  auto layer = typed<XrPassthroughLayerCreateInfoFB>(XR_TYPE_PASSTHROUGH_LAYER_CREATE_INFO_FB);
  layer.passthrough = passThrough_;
  layer.purpose = XR_PASSTHROUGH_LAYER_PURPOSE_RECONSTRUCTION_FB;
  layer.flags = XR_PASSTHROUGH_IS_RUNNING_AT_CREATION_BIT_FB;
  const XrResult result = functionOf<PFN_xrCreatePassthroughLayerFB>(
      instance.get(), "xrCreatePassthroughLayerFB")(session, &layer, &layer_);
  if (XR_FAILED(result)) destroy_(passThrough_);
  check(result, "xrCreatePassthroughLayerFB");
  composition_ = typed<XrCompositionLayerPassthroughFB>(XR_TYPE_COMPOSITION_LAYER_PASSTHROUGH_FB);
  composition_.flags = XR_COMPOSITION_LAYER_BLEND_TEXTURE_SOURCE_ALPHA_BIT;
  composition_.layerHandle = layer_;
}

PassThroughLayer::~PassThroughLayer() {
  destroyLayer_(layer_);
  destroy_(passThrough_);
}

const XrCompositionLayerBaseHeader* PassThroughLayer::layer() const {
  return reinterpret_cast<const XrCompositionLayerBaseHeader*>(&composition_);
}

}  // namespace clothstream::xr
