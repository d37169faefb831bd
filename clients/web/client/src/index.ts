// SPDX-License-Identifier: MIT
// What the package offers.

export { Client } from "./client";
export * from "./session";
export { Frames } from "./frames";
export { Input } from "./input";
export { kMostSurfaceTriangles, SurfacePolicy, Surfaces, type RoomSurface, type Surface } from "./surfaces";
export type { Proof } from "./thread_messages";
export * from "./types";
export { BodyPart, Wearing, type BodyPose, type TrackedBody } from "./wearing";
export {
  sceneBytes,
  type FigureJoint,
  type FigureKey,
  type FigurePose,
  type MeshScene,
  type SceneFigure,
  type SkinLimitLists,
} from "./scene_bytes";
export { kClothParameters, kSettings, type ClothParameter, type NumberRange } from "./tables";
export type { ClothChange, ClothSettings, SolverSettings } from "./cloth_settings";
export type { Answer, Ban, SceneRequests, SceneSummary } from "./scene_requests";
