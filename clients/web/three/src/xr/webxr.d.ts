// SPDX-License-Identifier: MIT
// Functions of WebXR Hand Input that the installed types do not declare.

interface XRFrame {
  fillPoses?(spaces: Iterable<XRSpace>, baseSpace: XRSpace, transforms: Float32Array): boolean;
  fillJointRadii?(jointSpaces: Iterable<XRJointSpace>, radii: Float32Array): boolean;
}
