// SPDX-License-Identifier: MIT
// For tests that run in Node, such as with vitest: a clothstream-server, and the frames that it sends.

export { frames, type FollowOptions, type ReceivedFrame, type SocketConstructor } from "./frames";
export { clothstream, type ClothstreamFixtures } from "./fixtures";
export { playRecording, startServer, type PlayOptions, type Server, type ServerOptions } from "./server";
