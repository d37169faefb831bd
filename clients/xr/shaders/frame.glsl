// SPDX-License-Identifier: MIT
// The frame, and what view is drawn.
#ifndef CLOTHSTREAM_XR_SHADERS_FRAME
#define CLOTHSTREAM_XR_SHADERS_FRAME
#extension GL_EXT_multiview : require
#include "clients/xr/shaders/records.h"

layout(set = 0, binding = kFrameBinding, std140) uniform FrameBlock {
  Frame frame;
};
#endif
