// SPDX-License-Identifier: MIT
// The real room behind the picture: a blend mode of the runtime, or a layer of XR_FB_passthrough.
#pragma once

#include <span>

#include "clients/xr/openxr/instance.h"
#include "clients/xr/stage/stage.h"

namespace clothstream::xr {

// How the picture and the real room are joined.
struct Blending {
  XrEnvironmentBlendMode mode = XR_ENVIRONMENT_BLEND_MODE_OPAQUE;
  bool usesLayer = false;  // of XR_FB_passthrough, below the picture
  Background background = Background::kRoom;
};

// Chooses among the blend modes of a headset, the preferred one first. wantsRoom: the user wants to see the
// real room. Displays that add light have no other way. Without any way to see the real room, the picture is
// opaque.
Blending chooseBlending(std::span<const XrEnvironmentBlendMode> modes, bool hasLayer, bool wantsRoom);

// Pass-through of XR_FB_passthrough, which runs as long as this object exists.
class PassThroughLayer {
 public:
  PassThroughLayer(const Instance& instance, XrSession session);
  ~PassThroughLayer();
  PassThroughLayer(const PassThroughLayer&) = delete;
  PassThroughLayer& operator=(const PassThroughLayer&) = delete;

  const XrCompositionLayerBaseHeader* layer() const;

 private:
  PFN_xrDestroyPassthroughFB destroy_ = nullptr;
  PFN_xrDestroyPassthroughLayerFB destroyLayer_ = nullptr;
  XrPassthroughFB passThrough_ = XR_NULL_HANDLE;
  XrPassthroughLayerFB layer_ = XR_NULL_HANDLE;
  XrCompositionLayerPassthroughFB composition_{};
};

}  // namespace clothstream::xr
