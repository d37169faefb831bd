// SPDX-License-Identifier: MIT
// Plain data of the client: what the scene contains and what a program can set. Units are SI.

export type Vec3 = readonly [number, number, number];
export type Quaternion = readonly [number, number, number, number]; // x, y, z, w

export enum ClientState {
  joining = 0,
  joined = 1,
  failed = 2,
  reconnecting = 3,
}

export const ClientEvent = {
  frame: 1,
  description: 2,
  notice: 4,
  error: 8,
  parameters: 16,
  scenes: 32,
  report: 64,
  grabs: 128,
  participants: 512,
  returned: 2048,
  playback: 4096,
  token: 8192,
  pairingCode: 16384,
  answer: 32768,
  moving: 65536,
  datagrams: 131072,
  surfaces: 262144,
} as const;

// Values of Client.errorCode and of SessionState: ErrorCode of session.proto. A newer server may have more.
export const ErrorCode = {
  notFound: 3,
  unsupportedVersion: 4,
  unsupportedCodec: 5,
  resourceExhausted: 8,
  permissionDenied: 30,
  takenOver: 32,
  removed: 33,
  // After these a person must give a token or a pairing code.
  unauthenticated: 60,
  wrongPairingCode: 61,
} as const;

export interface PairingCode {
  code: string;
  role: number;
  validSeconds: number;
}

export interface Statistics {
  tick: number;
  frames: number;
  keyFrames: number;
  dropped: number;
  decodeErrors: number;
  bytes: number;
  hashMismatches: number;
  framesPerSecond: number;
  kbitPerSecond: number;
  bitsPerVertex: number;
  roundTripMs: number;
}

// Counts of one association of datagrams (cs_datagram_statistics).
export interface DatagramStatistics {
  inUse: boolean; // a datagram has arrived in the last 500 ms
  packets: number; // datagrams with pieces of frames that arrived
  lostPackets: number;
  parityPackets: number; // of packets, those with parity
  frames: number; // complete ones
  repairedFrames: number; // of these, those that needed parity or a request
  lostFrames: number;
  requests: number; // for missing pieces
  heldFrames: number; // frames of both ways that waited for their reference
}

// How frames and input travel. "auto": in datagrams where they can be opened, else on the WebSocket. "datagrams": joining
// fails where they cannot be opened. "tcp": on the WebSocket.
export const kTransports = ["auto", "datagrams", "tcp"] as const;
export type Transport = (typeof kTransports)[number];

// How frames travel at present.
export interface Link {
  transport: "datagrams" | "websocket";
  reason: string; // why not in datagrams; "" if they do
  statistics: DatagramStatistics | undefined; // while a data channel is open
}

// Time that a frame spends in each stage, and state of play-out (cs_stage_statistics).
export interface Stages {
  framesWaiting: number; // arrived before their display time
  lateFrames: number;
  ledOnMs: number; // display time with extrapolated frames
  heldMs: number; // display time with a held frame
  delayMs: number;
  wantedDelayMs: number;
  serverMs: number; // from the start of the tick to the complete packet
  networkMs: number;
  decodeMs: number;
  displayableMs: number; // sum of these three
}

export interface ClothLayout {
  name: string;
  firstVertex: number;
  vertexCount: number;
  rows: number;
  columns: number;
  firstIndex: number;
  indexCount: number;
}

// Texture coordinates and submeshes of a mesh. Empty for a grid.
export interface Drawing {
  uvs: Float32Array; // (u, v) pairs, v upwards; may be empty
  uvIndices: Uint32Array; // one per corner of the cloth's triangles
  submeshes: { name: string; firstIndex: number; indexCount: number }[]; // indices count in the scene's triangles
}

export enum Shape {
  sphere = 0,
  capsule = 1,
  plane = 2,
  box = 3,
  hull = 4,
}

// Lengths in metres, in the collider's own frame (core.h).
export interface Collider {
  index: number;
  name: string;
  shape: Shape;
  position: Vec3;
  orientation: Quaternion;
  radius: number;
  topRadius: number; // of a capsule: of its end at +Y; else the same as radius
  length: number;
  size: Vec3;
  participantId: bigint; // 0 for a collider of the scene
  isHead: boolean; // of its participant
  yields: boolean; // it is not where its participant put it, because the cloth there has no room to give way
}

// Vertices (3 floats each) and triangles (3 indices each).
export interface Hull {
  vertices: Float32Array;
  triangles: Uint32Array;
}

// Names of cs_role. A newer server may have more roles.
export const Roles: ReadonlyMap<number, string> = new Map([
  [1, "viewer"],
  [2, "participant"],
  [3, "owner"],
]);

export interface Participant {
  id: bigint;
  name: string; // the program's name if the participant has none
  role: number;
  away: boolean; // disconnected, within the reconnect grace
  self: boolean;
  body: string; // name of the collider that it wears; "" for none
}

// Stiffness in N/m and damping in N s/m.
export type Spring = readonly [number, number];

export interface ColliderChange {
  position?: Vec3; // m
  orientation?: readonly [number, number, number, number]; // quaternion x y z w
  radius?: number; // m; sphere or capsule
  length?: number; // m; capsule
  size?: Vec3; // m; box
  friction?: number;
}

export interface Environment {
  gravity: Vec3; // m/s^2
  wind: Vec3; // m/s
  airDensity: number; // kg/m^3
  gustStrength: number; // m/s
  gustSeconds: number;
}

export interface ClothParameters {
  structural: Spring;
  shear: Spring;
  bend: Spring;
  damping: number; // 1/s
}

// Names of cs_solver. A newer server may have more solvers.
export const Solvers: ReadonlyMap<number, string> = new Map([
  [1, "mass-spring"],
  [2, "constraint"],
  [3, "ACAD"],
  [4, "XPBD"],
  [5, "implicit Euler"],
]);

// Health of one cloth's simulation (cs_cloth_report). SI units; strains are fractions of a length.
export interface ClothReport {
  activeConstraints: number;
  iterations: number;
  residual: number;
  strainMax: number;
  strainP99: number;
  strainMean: number;
  kineticEnergy: number;
  elasticEnergy: number;
  gravityEnergy: number;
  penetration: number;
  deviceMs: number;
  tick: number;
}

// State of a recording that is played.
export interface Playback {
  length: number; // s
  position: number; // current time in the recording, s
  speed: number;
  loop: boolean;
  paused: boolean;
}

// Point of a cloth as it is shown. The core knows the rest of it.
export interface ClothPoint {
  position: Vec3;
  distance: number; // from the origin of the ray, m
  place: Uint8Array; // cs_cloth_point
}

// Grab of the cloth at a place, which is drawn to the position.
export interface Grab {
  id: number;
  position: Vec3;
  orientation?: Quaternion; // with which the held part turns; none: it does not turn
  place: Uint8Array;
}

// Change of a grab of this participant.
export interface GrabEvent {
  grab: number;
  vertices: number; // held now; 0: it slipped or was released
  distance: number; // from the grab's position to its place when it took hold, m; 0 later
  ticksSinceSeen: number; // ticks of the simulation since the frame in which the place was seen
}

// Collider of this participant: sphere, capsule or box. Lengths in metres.
export interface OwnCollider {
  shape: Shape.sphere | Shape.capsule | Shape.box;
  position: Vec3;
  orientation?: Quaternion;
  radius?: number;
  topRadius?: number; // of a capsule's end at +Y; absent: the same as radius
  length?: number; // of a capsule's segment, along its y axis
  size?: Vec3;
}

// Values are cs_wind_kind of clients/core/core.h.
export enum WindKind {
  fan = 0,
  vortex = 1,
}

// Local wind that this participant holds. Lengths in metres; what is absent has the server's default.
export interface OwnWind {
  kind: WindKind;
  position: Vec3;
  orientation?: Quaternion; // turns +Y to the axis
  speed: number; // m/s
  radius?: number; // of a fan's opening, or of a vortex's core
  spread?: number; // of a fan: growth of its radius for each metre of distance
  reach?: number; // a fan's range, or a vortex's reach
}

// Head of this participant. Lengths in metres.
export interface Head {
  position: Vec3;
  orientation?: Quaternion; // none: unknown
  radius: number;
}

export enum HandSide {
  left = 1,
  right = 2,
}

export const kMaxColliders = 40;
export const kHeadId = 0x80000040; // CS_HEAD_ID
export const kMaxGrabs = 10;
export const kMaxWinds = 2;

// A joining participant: displayed name (may be empty) and requested role (key of Roles, or 0 for any).
export interface Identity {
  name: string;
  role: number;
}
