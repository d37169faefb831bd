// SPDX-License-Identifier: MIT
// What the package offers.

export * from "./cloth_mesh";
export { Cloths } from "./cloths";
export * from "./collider_meshes";
export { ConstraintLines } from "./constraint_lines";
export { type Detail, tiled } from "./fabric_material";
export { FanFigure, heldFan } from "./fan";
export { fabricNames, fabricOf, type Fabric } from "./fabrics";
export { Mirror } from "./mirror";
export * from "./people";
export { RoomOutlines } from "./room_outlines";
export { hash, noise } from "./weave";
export { Body } from "./xr/body";
export { CanvasPanel } from "./xr/canvas_panel";
export type { PanelButton, PanelDrawing, PanelRow } from "./xr/panel_layout";
export { Figures } from "./xr/figures";
export { Grabber, newGrabId, type GrabPose, type Touchable } from "./xr/grabber";
export { chooseRate, Immersion, type ImmersionListener, type Mode } from "./xr/immersion";
export { Headset, type Doing, type HeadsetHost, type HeadsetListener } from "./xr/headset";
export { Limb } from "./xr/limb";
export { DetectedSurfaces, type DetectedSurface } from "./xr/detected_surfaces";
export { RealRoom } from "./xr/real_room";
export * from "./xr/room_mesh";
export { Wearer } from "./xr/wearer";
export { Placement, TwoHandMove } from "./xr/placement";
