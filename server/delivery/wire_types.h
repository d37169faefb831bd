// SPDX-License-Identifier: MIT
// Forward declarations of the wire's messages, so that headers need not include the generated ones.
#pragma once

namespace clothstream::v1 {

class Chunk;
class ClientMessage;
class ColliderPoses;
class ControlSceneRequest;
class ControlSceneResponse;
class CreateSceneRequest;
class CreateSceneResponse;
class DeleteSceneRequest;
class DeleteSceneResponse;
class Error;
class AuthenticateRequest;
class AuthenticateResponse;
class CreatePairingCodeRequest;
class CreatePairingCodeResponse;
class Frame;
class GetSceneRequest;
class GetSceneResponse;
class GetSurfacePartRequest;
class GetSurfacePartResponse;
class Hello;
class LiftBanRequest;
class LiftBanResponse;
class ListBansRequest;
class ListBansResponse;
class ListScenesResponse;
class ParameterChange;
class Participant;
class Playback;
class RemoveParticipant;
class SceneSummary;
class ServerMessage;
class SetRole;
class SimulationReport;
class StartRecordingRequest;
class StartRecordingResponse;
class StopRecordingRequest;
class StopRecordingResponse;
class StreamDescription;
class SurfaceLimits;
class SurfacePart;
class SurfaceUpdate;
class TickEvents;

enum ErrorCode : int;
enum NoticeKind : int;
enum PresenceKind : int;
enum Role : int;

}  // namespace clothstream::v1
