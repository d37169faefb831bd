// SPDX-License-Identifier: MIT
// Field numbers, wire types and enum values of the protocol. Generated from the .proto files by
// tests/core/generate_field_numbers.cpp. Do not edit.
#pragma once

// clang-format off
#include <cstdint>

namespace clothstream::client::field {

enum class WireType : std::uint32_t { kVarint = 0, kFixed64 = 1, kBytes = 2, kFixed32 = 5 };

// `number` writes the field. `tag` recognises it: number and wire type as they stand on the wire.
struct Field {
  std::uint32_t number, tag;
  constexpr Field(std::uint32_t fieldNumber, WireType type)
      : number(fieldNumber), tag(fieldNumber << 3 | static_cast<std::uint32_t>(type)) {}
};

// clothstream/v1/scene.proto
struct Integrator {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kSemiImplicitEuler = 1;
  static constexpr std::uint32_t kExplicitEuler = 2;
  static constexpr std::uint32_t kRungeKutta4 = 3;
};
struct AcadMode {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kPaper = 2;
  static constexpr std::uint32_t kLimit = 3;
};
struct ConstraintPath {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kMatrixFree = 1;
  static constexpr std::uint32_t kAssembled = 2;
};
struct Normals {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kNone = 1;
  static constexpr std::uint32_t kOctahedral = 2;
};
struct Vec3 {
  static constexpr Field kX{1, WireType::kFixed32};
  static constexpr Field kY{2, WireType::kFixed32};
  static constexpr Field kZ{3, WireType::kFixed32};
};
struct Quaternion {
  static constexpr Field kX{1, WireType::kFixed32};
  static constexpr Field kY{2, WireType::kFixed32};
  static constexpr Field kZ{3, WireType::kFixed32};
  static constexpr Field kW{4, WireType::kFixed32};
};
struct Pose {
  static constexpr Field kPosition{1, WireType::kBytes};
  static constexpr Field kOrientation{2, WireType::kBytes};
};
struct Scene {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kDescription{2, WireType::kBytes};
  static constexpr Field kSimulationRate{3, WireType::kVarint};
  static constexpr Field kStreamRate{4, WireType::kVarint};
  static constexpr Field kSubsteps{5, WireType::kVarint};
  static constexpr Field kIntegrator{6, WireType::kVarint};
  static constexpr Field kEnvironment{7, WireType::kBytes};
  static constexpr Field kCloths{8, WireType::kBytes};
  static constexpr Field kColliders{9, WireType::kBytes};
  static constexpr Field kStream{10, WireType::kBytes};
};
struct Environment {
  static constexpr Field kGravity{1, WireType::kBytes};
  static constexpr Field kWind{2, WireType::kBytes};
  static constexpr Field kAirDensity{3, WireType::kFixed32};
  static constexpr Field kGust{4, WireType::kBytes};
  static constexpr Field kWinds{5, WireType::kBytes};
};
struct Gust {
  static constexpr Field kStrength{1, WireType::kFixed32};
  static constexpr Field kSeconds{2, WireType::kFixed32};
};
struct LocalWind {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kPose{2, WireType::kBytes};
  static constexpr Field kSpeed{3, WireType::kFixed32};
  static constexpr Field kFan{4, WireType::kBytes};
  static constexpr Field kVortex{5, WireType::kBytes};
};
struct Fan {
  static constexpr Field kRadius{1, WireType::kFixed32};
  static constexpr Field kSpread{2, WireType::kFixed32};
  static constexpr Field kRange{3, WireType::kFixed32};
};
struct Vortex {
  static constexpr Field kRadius{1, WireType::kFixed32};
  static constexpr Field kReach{2, WireType::kFixed32};
};
struct Cloth {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kGrid{2, WireType::kBytes};
  static constexpr Field kMesh{14, WireType::kBytes};
  static constexpr Field kMass{4, WireType::kFixed32};
  static constexpr Field kStructural{5, WireType::kBytes};
  static constexpr Field kShear{6, WireType::kBytes};
  static constexpr Field kBend{7, WireType::kBytes};
  static constexpr Field kDamping{8, WireType::kFixed32};
  static constexpr Field kDrag{9, WireType::kFixed32};
  static constexpr Field kLift{10, WireType::kFixed32};
  static constexpr Field kFriction{11, WireType::kFixed32};
  static constexpr Field kThickness{12, WireType::kFixed32};
  static constexpr Field kPins{13, WireType::kBytes};
  static constexpr Field kPinnedVertices{15, WireType::kBytes};
  static constexpr Field kPinnedRegions{16, WireType::kBytes};
  static constexpr Field kSolver{20, WireType::kBytes};
  static constexpr Field kSelfCollision{21, WireType::kBytes};
  static constexpr Field kAttachments{22, WireType::kBytes};
  static constexpr Field kTethers{23, WireType::kBytes};
  static constexpr Field kDihedralBending{24, WireType::kFixed32};
  static constexpr Field kMaterial{40, WireType::kBytes};
  static constexpr Field kArealMass{41, WireType::kFixed32};
  static constexpr Field kCoarse{42, WireType::kBytes};
  static constexpr Field kSkin{43, WireType::kBytes};
  static constexpr Field kPressure{44, WireType::kFixed32};
};
struct ClothSkin {
  static constexpr Field kCollider{1, WireType::kBytes};
  static constexpr Field kVertexJoints{2, WireType::kBytes};
  static constexpr Field kVertexWeights{3, WireType::kBytes};
  static constexpr Field kLimits{4, WireType::kBytes};
  static constexpr Field kMaxDistances{5, WireType::kBytes};
  static constexpr Field kBackstopDistances{6, WireType::kBytes};
  static constexpr Field kBackstopRadii{7, WireType::kBytes};
  static constexpr Field kColourDistance{8, WireType::kBytes};
  static constexpr Field kRegions{9, WireType::kBytes};
};
struct SkinLimits {
  static constexpr Field kMaxDistance{1, WireType::kFixed32};
  static constexpr Field kBackstopDistance{2, WireType::kFixed32};
  static constexpr Field kBackstopRadius{3, WireType::kFixed32};
};
struct ColourDistance {
  static constexpr Field kChannel{1, WireType::kVarint};
  static constexpr Field kDistance{2, WireType::kFixed32};
};
struct SkinRegion {
  static constexpr Field kRegion{1, WireType::kBytes};
  static constexpr Field kLimits{2, WireType::kBytes};
};
struct Attachment {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kRanges{2, WireType::kBytes};
  static constexpr Field kVertices{3, WireType::kBytes};
  static constexpr Field kRegions{4, WireType::kBytes};
  static constexpr Field kCollider{5, WireType::kBytes};
  static constexpr Field kPose{6, WireType::kBytes};
  static constexpr Field kMotion{7, WireType::kBytes};
};
struct Tethers {
  static constexpr Field kSlack{1, WireType::kFixed32};
};
struct CoarseCorrection {
  static constexpr Field kCells{1, WireType::kVarint};
  static constexpr Field kSweeps{2, WireType::kVarint};
  static constexpr Field kEvery{3, WireType::kVarint};
  static constexpr Field kLevels{4, WireType::kVarint};
};
struct SelfCollision {
  static constexpr Field kRadius{1, WireType::kFixed32};
  static constexpr Field kFriction{2, WireType::kFixed32};
  static constexpr Field kNothingPasses{42, WireType::kVarint};
};
struct Solver {
  static constexpr Field kMassSpring{1, WireType::kBytes};
  static constexpr Field kConstraint{2, WireType::kBytes};
  static constexpr Field kAcad{3, WireType::kBytes};
  static constexpr Field kXpbd{4, WireType::kBytes};
  static constexpr Field kImplicitEuler{5, WireType::kBytes};
};
struct AcadSolver {
  static constexpr Field kActivation{1, WireType::kFixed32};
  static constexpr Field kConstraint{2, WireType::kBytes};
  static constexpr Field kMode{12, WireType::kVarint};
};
struct ImplicitEulerSolver {
  static constexpr Field kIterations{1, WireType::kVarint};
  static constexpr Field kTolerance{2, WireType::kFixed32};
};
struct ConstraintSolver {
  static constexpr Field kBendConstraints{1, WireType::kVarint};
  static constexpr Field kCompliance{2, WireType::kFixed32};
  static constexpr Field kIterations{3, WireType::kVarint};
  static constexpr Field kTolerance{4, WireType::kFixed32};
  static constexpr Field kPath{5, WireType::kVarint};
};
struct XpbdSolver {
  static constexpr Field kIterations{1, WireType::kVarint};
  static constexpr Field kCompliance{2, WireType::kFixed32};
};
struct Grid {
  static constexpr Field kRows{1, WireType::kVarint};
  static constexpr Field kColumns{2, WireType::kVarint};
  static constexpr Field kWidth{3, WireType::kFixed32};
  static constexpr Field kHeight{4, WireType::kFixed32};
  static constexpr Field kPose{5, WireType::kBytes};
};
struct Mesh {
  static constexpr Field kFile{1, WireType::kBytes};
  static constexpr Field kPositions{2, WireType::kBytes};
  static constexpr Field kTriangles{3, WireType::kBytes};
  static constexpr Field kQuads{4, WireType::kBytes};
  static constexpr Field kUvs{5, WireType::kBytes};
  static constexpr Field kUvTriangles{6, WireType::kBytes};
  static constexpr Field kSubmeshes{7, WireType::kBytes};
  static constexpr Field kPose{8, WireType::kBytes};
  static constexpr Field kScale{9, WireType::kFixed32};
  static constexpr Field kWeldDistance{10, WireType::kFixed32};
  static constexpr Field kRepair{70, WireType::kVarint};
  static constexpr Field kFit{71, WireType::kVarint};
};
struct MeshRepair {
  static constexpr Field kCloth{1, WireType::kBytes};
  static constexpr Field kTriangulatedFaces{2, WireType::kVarint};
  static constexpr Field kDroppedFaces{3, WireType::kVarint};
  static constexpr Field kDroppedDuplicates{4, WireType::kVarint};
  static constexpr Field kSplitEdges{5, WireType::kVarint};
  static constexpr Field kSplitVertices{6, WireType::kVarint};
  static constexpr Field kAddedVertices{7, WireType::kVarint};
  static constexpr Field kTurnedTriangles{8, WireType::kVarint};
  static constexpr Field kCutEdges{9, WireType::kVarint};
  static constexpr Field kFittedScale{10, WireType::kFixed32};
  static constexpr Field kSentences{11, WireType::kBytes};
};
struct Submesh {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kTriangleCount{2, WireType::kVarint};
};
struct Region {
  static constexpr Field kCentre{1, WireType::kBytes};
  static constexpr Field kRadius{2, WireType::kFixed32};
  static constexpr Field kSize{3, WireType::kBytes};
};
struct GridRange {
  static constexpr Field kFirstRow{1, WireType::kVarint};
  static constexpr Field kLastRow{2, WireType::kVarint};
  static constexpr Field kRowStep{3, WireType::kVarint};
  static constexpr Field kFirstColumn{4, WireType::kVarint};
  static constexpr Field kLastColumn{5, WireType::kVarint};
  static constexpr Field kColumnStep{6, WireType::kVarint};
};
struct Spring {
  static constexpr Field kStiffness{1, WireType::kFixed32};
  static constexpr Field kDamping{2, WireType::kFixed32};
};
struct Collider {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kSphere{2, WireType::kBytes};
  static constexpr Field kCapsule{3, WireType::kBytes};
  static constexpr Field kPlane{4, WireType::kBytes};
  static constexpr Field kBox{5, WireType::kBytes};
  static constexpr Field kHull{6, WireType::kBytes};
  static constexpr Field kMesh{30, WireType::kBytes};
  static constexpr Field kPose{8, WireType::kBytes};
  static constexpr Field kFriction{9, WireType::kFixed32};
  static constexpr Field kMotion{10, WireType::kBytes};
};
struct Sphere {
  static constexpr Field kRadius{1, WireType::kFixed32};
};
struct Capsule {
  static constexpr Field kRadius{1, WireType::kFixed32};
  static constexpr Field kLength{2, WireType::kFixed32};
  static constexpr Field kTopRadius{3, WireType::kFixed32};
};
struct Box {
  static constexpr Field kSize{1, WireType::kBytes};
};
struct ConvexHull {
  static constexpr Field kVertices{1, WireType::kBytes};
  static constexpr Field kFaces{2, WireType::kBytes};
};
struct Face {
  static constexpr Field kVertices{1, WireType::kBytes};
};
struct ColliderMesh {
  static constexpr Field kFile{1, WireType::kBytes};
  static constexpr Field kAnimation{25, WireType::kBytes};
  static constexpr Field kPositions{2, WireType::kBytes};
  static constexpr Field kTriangles{3, WireType::kBytes};
  static constexpr Field kScale{4, WireType::kFixed32};
  static constexpr Field kSkin{5, WireType::kBytes};
  static constexpr Field kDistanceCell{6, WireType::kFixed32};
};
struct Skin {
  static constexpr Field kJoints{1, WireType::kBytes};
  static constexpr Field kVertexJoints{2, WireType::kBytes};
  static constexpr Field kVertexWeights{3, WireType::kBytes};
  static constexpr Field kAnimation{4, WireType::kBytes};
};
struct Joint {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kParent{2, WireType::kVarint};
  static constexpr Field kRest{3, WireType::kBytes};
};
struct JointAnimation {
  static constexpr Field kKeys{1, WireType::kBytes};
};
struct JointKey {
  static constexpr Field kTime{1, WireType::kFixed32};
  static constexpr Field kJoints{2, WireType::kBytes};
};
struct Motion {
  static constexpr Field kKeys{1, WireType::kBytes};
  static constexpr Field kSteady{2, WireType::kVarint};
};
struct MotionKey {
  static constexpr Field kTime{1, WireType::kFixed32};
  static constexpr Field kPosition{2, WireType::kBytes};
  static constexpr Field kOrientation{3, WireType::kBytes};
};
struct StreamSettings {
  static constexpr Field kMaxError{1, WireType::kFixed32};
  static constexpr Field kNormals{2, WireType::kVarint};
  static constexpr Field kQualities{51, WireType::kVarint};
};

// clothstream/v1/session.proto
struct Role {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kViewer = 1;
  static constexpr std::uint32_t kParticipant = 2;
  static constexpr std::uint32_t kOwner = 3;
};
struct PresenceKind {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kJoined = 1;
  static constexpr std::uint32_t kLeft = 2;
  static constexpr std::uint32_t kRoleChanged = 3;
  static constexpr std::uint32_t kDisconnected = 4;
  static constexpr std::uint32_t kReturned = 5;
  static constexpr std::uint32_t kBodyChanged = 6;
};
struct LeaveReason {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kLeft = 1;
  static constexpr std::uint32_t kTimedOut = 2;
  static constexpr std::uint32_t kRemoved = 3;
};
struct ContentKind {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kStreamDescription = 1;
  static constexpr std::uint32_t kScene = 2;
};
struct HandSide {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kLeft = 1;
  static constexpr std::uint32_t kRight = 2;
};
struct ContactEventKind {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kBegan = 1;
  static constexpr std::uint32_t kEnded = 2;
};
struct GrabEventKind {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kTaken = 1;
  static constexpr std::uint32_t kSlipped = 2;
  static constexpr std::uint32_t kReleased = 3;
};
struct SurfacePolicy {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kOff = 1;
  static constexpr std::uint32_t kOwn = 2;
  static constexpr std::uint32_t kEveryone = 3;
};
struct NoticeKind {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kRolledBack = 1;
  static constexpr std::uint32_t kDeviceRebuilt = 2;
  static constexpr std::uint32_t kServerStopping = 3;
  static constexpr std::uint32_t kRunningSlow = 4;
  static constexpr std::uint32_t kChangeUndone = 20;
  static constexpr std::uint32_t kSceneDeleted = 21;
  static constexpr std::uint32_t kScenePaused = 22;
  static constexpr std::uint32_t kSceneResumed = 23;
  static constexpr std::uint32_t kSceneReset = 24;
  static constexpr std::uint32_t kRecordingStarted = 40;
  static constexpr std::uint32_t kRecordingStopped = 41;
  static constexpr std::uint32_t kRecordingDamaged = 42;
  static constexpr std::uint32_t kLoadChanged = 60;
};
struct ErrorCode {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kMalformedMessage = 1;
  static constexpr std::uint32_t kInvalidArgument = 2;
  static constexpr std::uint32_t kNotFound = 3;
  static constexpr std::uint32_t kUnsupportedVersion = 4;
  static constexpr std::uint32_t kUnsupportedCodec = 5;
  static constexpr std::uint32_t kRateLimited = 6;
  static constexpr std::uint32_t kOutOfOrder = 7;
  static constexpr std::uint32_t kResourceExhausted = 8;
  static constexpr std::uint32_t kPermissionDenied = 30;
  static constexpr std::uint32_t kCutOff = 31;
  static constexpr std::uint32_t kTakenOver = 32;
  static constexpr std::uint32_t kRemoved = 33;
  static constexpr std::uint32_t kUnauthenticated = 60;
  static constexpr std::uint32_t kWrongPairingCode = 61;
};
struct ClientMessage {
  static constexpr Field kRequestId{1, WireType::kVarint};
  static constexpr Field kHello{2, WireType::kBytes};
  static constexpr Field kColliderPoses{3, WireType::kBytes};
  static constexpr Field kParameterChange{4, WireType::kBytes};
  static constexpr Field kPing{5, WireType::kBytes};
  static constexpr Field kFrameAck{6, WireType::kBytes};
  static constexpr Field kKeyFrameRequest{7, WireType::kBytes};
  static constexpr Field kListScenes{16, WireType::kBytes};
  static constexpr Field kGetScene{17, WireType::kBytes};
  static constexpr Field kCreateScene{18, WireType::kBytes};
  static constexpr Field kDeleteScene{19, WireType::kBytes};
  static constexpr Field kControlScene{20, WireType::kBytes};
  static constexpr Field kUpload{21, WireType::kBytes};
  static constexpr Field kSetRole{30, WireType::kBytes};
  static constexpr Field kRemoveParticipant{31, WireType::kBytes};
  static constexpr Field kWearBody{32, WireType::kBytes};
  static constexpr Field kStartRecording{40, WireType::kBytes};
  static constexpr Field kStopRecording{41, WireType::kBytes};
  static constexpr Field kAuthenticate{60, WireType::kBytes};
  static constexpr Field kCreatePairingCode{61, WireType::kBytes};
  static constexpr Field kListBans{62, WireType::kBytes};
  static constexpr Field kLiftBan{63, WireType::kBytes};
  static constexpr Field kDatagramOffer{70, WireType::kBytes};
  static constexpr Field kSurface{80, WireType::kBytes};
  static constexpr Field kGetSurfacePart{81, WireType::kBytes};
};
struct ServerMessage {
  static constexpr Field kRequestId{1, WireType::kVarint};
  static constexpr Field kWelcome{2, WireType::kBytes};
  static constexpr Field kChunk{3, WireType::kBytes};
  static constexpr Field kFrame{4, WireType::kBytes};
  static constexpr Field kPong{5, WireType::kBytes};
  static constexpr Field kNotice{6, WireType::kBytes};
  static constexpr Field kParameterChanged{7, WireType::kBytes};
  static constexpr Field kError{8, WireType::kBytes};
  static constexpr Field kTickEvents{9, WireType::kBytes};
  static constexpr Field kMoving{10, WireType::kBytes};
  static constexpr Field kListScenes{16, WireType::kBytes};
  static constexpr Field kGetScene{17, WireType::kBytes};
  static constexpr Field kCreateScene{18, WireType::kBytes};
  static constexpr Field kDeleteScene{19, WireType::kBytes};
  static constexpr Field kControlScene{20, WireType::kBytes};
  static constexpr Field kPresence{30, WireType::kBytes};
  static constexpr Field kPlayback{40, WireType::kBytes};
  static constexpr Field kStartRecording{41, WireType::kBytes};
  static constexpr Field kStopRecording{42, WireType::kBytes};
  static constexpr Field kOperatingPoint{50, WireType::kBytes};
  static constexpr Field kAuthenticate{60, WireType::kBytes};
  static constexpr Field kCreatePairingCode{61, WireType::kBytes};
  static constexpr Field kListBans{62, WireType::kBytes};
  static constexpr Field kLiftBan{63, WireType::kBytes};
  static constexpr Field kDatagramAnswer{70, WireType::kBytes};
  static constexpr Field kRoomSurfaces{80, WireType::kBytes};
  static constexpr Field kGetSurfacePart{81, WireType::kBytes};
};
struct Hello {
  static constexpr Field kProtocolVersion{1, WireType::kVarint};
  static constexpr Field kCodecs{2, WireType::kBytes};
  static constexpr Field kScene{3, WireType::kBytes};
  static constexpr Field kClientName{4, WireType::kBytes};
  static constexpr Field kDisplayName{5, WireType::kBytes};
  static constexpr Field kQuality{6, WireType::kVarint};
  static constexpr Field kRole{30, WireType::kVarint};
  static constexpr Field kResumeToken{31, WireType::kBytes};
  static constexpr Field kDescriptionContentId{32, WireType::kVarint};
  static constexpr Field kAttempt{60, WireType::kVarint};
};
struct Welcome {
  static constexpr Field kProtocolVersion{1, WireType::kVarint};
  static constexpr Field kCodec{2, WireType::kVarint};
  static constexpr Field kScene{3, WireType::kBytes};
  static constexpr Field kParticipantId{4, WireType::kVarint};
  static constexpr Field kServerName{5, WireType::kBytes};
  static constexpr Field kDeviceName{6, WireType::kBytes};
  static constexpr Field kDescriptionContentId{7, WireType::kVarint};
  static constexpr Field kRole{30, WireType::kVarint};
  static constexpr Field kResumeToken{31, WireType::kBytes};
  static constexpr Field kResumed{32, WireType::kVarint};
  static constexpr Field kParticipants{33, WireType::kBytes};
  static constexpr Field kHoldMs{34, WireType::kVarint};
  static constexpr Field kAcknowledgeEveryFrame{80, WireType::kVarint};
  static constexpr Field kSurfaces{90, WireType::kBytes};
};
struct Participant {
  static constexpr Field kId{1, WireType::kVarint};
  static constexpr Field kDisplayName{2, WireType::kBytes};
  static constexpr Field kClientName{3, WireType::kBytes};
  static constexpr Field kRole{4, WireType::kVarint};
  static constexpr Field kAway{5, WireType::kVarint};
  static constexpr Field kBody{6, WireType::kBytes};
};
struct Presence {
  static constexpr Field kKind{1, WireType::kVarint};
  static constexpr Field kParticipant{2, WireType::kBytes};
  static constexpr Field kReason{3, WireType::kVarint};
  static constexpr Field kByParticipantId{4, WireType::kVarint};
};
struct SetRole {
  static constexpr Field kParticipantId{1, WireType::kVarint};
  static constexpr Field kRole{2, WireType::kVarint};
};
struct RemoveParticipant {
  static constexpr Field kParticipantId{1, WireType::kVarint};
  static constexpr Field kBan{60, WireType::kVarint};
};
struct WearBody {
  static constexpr Field kCollider{1, WireType::kBytes};
  static constexpr Field kStands{2, WireType::kBytes};
};
struct AuthenticateRequest {
  static constexpr Field kToken{1, WireType::kBytes};
  static constexpr Field kPairingCode{2, WireType::kBytes};
};
struct AuthenticateResponse {
  static constexpr Field kToken{1, WireType::kBytes};
  static constexpr Field kRole{2, WireType::kVarint};
  static constexpr Field kScene{3, WireType::kBytes};
  static constexpr Field kExpiresS{4, WireType::kVarint};
};
struct CreatePairingCodeRequest {
  static constexpr Field kRole{1, WireType::kVarint};
};
struct CreatePairingCodeResponse {
  static constexpr Field kCode{1, WireType::kBytes};
  static constexpr Field kRole{2, WireType::kVarint};
  static constexpr Field kValidS{3, WireType::kVarint};
};
struct Ban {
  static constexpr Field kSubject{1, WireType::kBytes};
  static constexpr Field kDisplayName{2, WireType::kBytes};
  static constexpr Field kTenant{3, WireType::kBytes};
};
struct ListBansRequest {
  static constexpr Field kScene{1, WireType::kBytes};
};
struct ListBansResponse {
  static constexpr Field kBans{1, WireType::kBytes};
};
struct LiftBanRequest {
  static constexpr Field kScene{1, WireType::kBytes};
  static constexpr Field kSubject{2, WireType::kBytes};
};
struct Chunk {
  static constexpr Field kContentId{1, WireType::kVarint};
  static constexpr Field kKind{2, WireType::kVarint};
  static constexpr Field kIndex{3, WireType::kVarint};
  static constexpr Field kCount{4, WireType::kVarint};
  static constexpr Field kTotalBytes{5, WireType::kVarint};
  static constexpr Field kData{6, WireType::kBytes};
};
struct StreamDescription {
  static constexpr Field kEpoch{1, WireType::kVarint};
  static constexpr Field kCodec{2, WireType::kVarint};
  static constexpr Field kScene{3, WireType::kBytes};
  static constexpr Field kSimulationRate{4, WireType::kVarint};
  static constexpr Field kStreamRate{5, WireType::kVarint};
  static constexpr Field kMaxError{6, WireType::kFixed32};
  static constexpr Field kNormals{7, WireType::kVarint};
  static constexpr Field kCloths{8, WireType::kBytes};
  static constexpr Field kColliders{9, WireType::kBytes};
  static constexpr Field kQualities{12, WireType::kVarint};
  static constexpr Field kOrigin{13, WireType::kBytes};
  static constexpr Field kDefinition{10, WireType::kBytes};
  static constexpr Field kMaterials{40, WireType::kBytes};
};
struct ClothDescription {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kVertexCount{2, WireType::kVarint};
  static constexpr Field kRows{3, WireType::kVarint};
  static constexpr Field kColumns{4, WireType::kVarint};
  static constexpr Field kRestPositions{5, WireType::kBytes};
  static constexpr Field kTriangles{6, WireType::kBytes};
  static constexpr Field kUvs{7, WireType::kBytes};
  static constexpr Field kUvTriangles{8, WireType::kBytes};
  static constexpr Field kSubmeshes{9, WireType::kBytes};
};
struct Frame {
  static constexpr Field kPacket{1, WireType::kBytes};
  static constexpr Field kTickTimeUs{2, WireType::kVarint};
  static constexpr Field kPacketTimeUs{3, WireType::kVarint};
  static constexpr Field kReconstructionHash{4, WireType::kFixed64};
  static constexpr Field kStateHash{5, WireType::kFixed64};
  static constexpr Field kColliders{6, WireType::kBytes};
  static constexpr Field kReport{7, WireType::kBytes};
  static constexpr Field kFrameDivisor{60, WireType::kVarint};
};
struct SimulationReport {
  static constexpr Field kCloths{1, WireType::kBytes};
  static constexpr Field kDeviceSeconds{2, WireType::kFixed64};
};
struct ClothReport {
  static constexpr Field kStrainMax{1, WireType::kFixed32};
  static constexpr Field kStrainP99{2, WireType::kFixed32};
  static constexpr Field kStrainMean{3, WireType::kFixed32};
  static constexpr Field kKineticEnergy{4, WireType::kFixed32};
  static constexpr Field kElasticEnergy{5, WireType::kFixed32};
  static constexpr Field kGravityEnergy{6, WireType::kFixed32};
  static constexpr Field kActiveConstraints{7, WireType::kVarint};
  static constexpr Field kIterations{8, WireType::kVarint};
  static constexpr Field kResidual{9, WireType::kFixed32};
  static constexpr Field kPenetration{10, WireType::kFixed32};
  static constexpr Field kConstraintEnds{71, WireType::kBytes};
};
struct ColliderState {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kPosition{2, WireType::kBytes};
  static constexpr Field kOrientation{3, WireType::kBytes};
  static constexpr Field kParticipantId{4, WireType::kVarint};
  static constexpr Field kSphere{5, WireType::kBytes};
  static constexpr Field kCapsule{6, WireType::kBytes};
  static constexpr Field kPlane{7, WireType::kBytes};
  static constexpr Field kBox{8, WireType::kBytes};
  static constexpr Field kHull{9, WireType::kBytes};
  static constexpr Field kMesh{30, WireType::kBytes};
  static constexpr Field kJoints{31, WireType::kBytes};
  static constexpr Field kYields{71, WireType::kVarint};
};
struct ColliderMeshDescription {
  static constexpr Field kPositions{1, WireType::kBytes};
  static constexpr Field kTriangles{2, WireType::kBytes};
  static constexpr Field kJoints{3, WireType::kBytes};
  static constexpr Field kWeights{4, WireType::kBytes};
  static constexpr Field kRest{5, WireType::kBytes};
  static constexpr Field kJointNames{6, WireType::kBytes};
  static constexpr Field kJointParents{7, WireType::kBytes};
};
struct OperatingPoint {
  static constexpr Field kQuality{1, WireType::kVarint};
};
struct FrameAck {
  static constexpr Field kTick{1, WireType::kVarint};
};
struct KeyFrameRequest {
  static constexpr Field kEpoch{1, WireType::kVarint};
  static constexpr Field kEarly{2, WireType::kVarint};
};
struct ColliderPoses {
  static constexpr Field kColliders{1, WireType::kBytes};
  static constexpr Field kClientTimeUs{2, WireType::kVarint};
  static constexpr Field kGrabs{3, WireType::kBytes};
  static constexpr Field kAttachments{4, WireType::kBytes};
  static constexpr Field kContactEvents{5, WireType::kVarint};
  static constexpr Field kServerTimeUs{60, WireType::kVarint};
  static constexpr Field kHands{61, WireType::kBytes};
  static constexpr Field kJoints{81, WireType::kBytes};
  static constexpr Field kActiveConstraints{82, WireType::kVarint};
  static constexpr Field kWinds{90, WireType::kBytes};
};
struct HeldWind {
  static constexpr Field kId{1, WireType::kVarint};
  static constexpr Field kWind{2, WireType::kBytes};
};
struct ColliderJoints {
  static constexpr Field kCollider{1, WireType::kBytes};
  static constexpr Field kJoints{2, WireType::kBytes};
  static constexpr Field kJumps{3, WireType::kVarint};
};
struct HandJoints {
  static constexpr Field kSide{1, WireType::kVarint};
  static constexpr Field kPositions{2, WireType::kBytes};
  static constexpr Field kRadii{3, WireType::kBytes};
};
struct Grab {
  static constexpr Field kId{1, WireType::kVarint};
  static constexpr Field kPose{2, WireType::kBytes};
  static constexpr Field kRadius{3, WireType::kFixed32};
  static constexpr Field kReach{4, WireType::kFixed32};
  static constexpr Field kMaxForce{5, WireType::kFixed32};
  static constexpr Field kSlipDistance{6, WireType::kFixed32};
  static constexpr Field kPlace{7, WireType::kBytes};
};
struct GrabPlace {
  static constexpr Field kCloth{1, WireType::kVarint};
  static constexpr Field kTriangle{2, WireType::kVarint};
  static constexpr Field kSecond{3, WireType::kFixed32};
  static constexpr Field kThird{4, WireType::kFixed32};
  static constexpr Field kSeenTick{5, WireType::kVarint};
};
struct AttachmentPose {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kPose{2, WireType::kBytes};
  static constexpr Field kJumps{3, WireType::kVarint};
};
struct ParticipantCollider {
  static constexpr Field kId{1, WireType::kVarint};
  static constexpr Field kPose{2, WireType::kBytes};
  static constexpr Field kSphere{3, WireType::kBytes};
  static constexpr Field kCapsule{4, WireType::kBytes};
  static constexpr Field kBox{5, WireType::kBytes};
};
struct ParameterChange {
  static constexpr Field kGravity{1, WireType::kBytes};
  static constexpr Field kWind{2, WireType::kBytes};
  static constexpr Field kAirDensity{3, WireType::kFixed32};
  static constexpr Field kCloths{4, WireType::kBytes};
  static constexpr Field kColliders{5, WireType::kBytes};
  static constexpr Field kGust{40, WireType::kBytes};
};
struct Vec3Value {
  static constexpr Field kValue{1, WireType::kBytes};
};
struct ClothChange {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kStructural{2, WireType::kBytes};
  static constexpr Field kShear{3, WireType::kBytes};
  static constexpr Field kBend{4, WireType::kBytes};
  static constexpr Field kDamping{5, WireType::kFixed32};
  static constexpr Field kDrag{6, WireType::kFixed32};
  static constexpr Field kLift{7, WireType::kFixed32};
  static constexpr Field kFriction{8, WireType::kFixed32};
  static constexpr Field kThickness{9, WireType::kFixed32};
  static constexpr Field kSolver{20, WireType::kBytes};
  static constexpr Field kSelfCollision{21, WireType::kBytes};
  static constexpr Field kTethers{23, WireType::kBytes};
  static constexpr Field kDihedralBending{24, WireType::kFixed32};
  static constexpr Field kMaterial{40, WireType::kBytes};
  static constexpr Field kArealMass{41, WireType::kFixed32};
  static constexpr Field kPressure{44, WireType::kFixed32};
};
struct ColliderChange {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kPosition{2, WireType::kBytes};
  static constexpr Field kOrientation{4, WireType::kBytes};
  static constexpr Field kRadius{3, WireType::kFixed32};
  static constexpr Field kLength{5, WireType::kFixed32};
  static constexpr Field kSize{6, WireType::kBytes};
  static constexpr Field kFriction{7, WireType::kFixed32};
};
struct ParameterChanged {
  static constexpr Field kChange{1, WireType::kBytes};
  static constexpr Field kParticipantId{2, WireType::kVarint};
  static constexpr Field kTick{3, WireType::kVarint};
};
struct TickEvents {
  static constexpr Field kTick{1, WireType::kVarint};
  static constexpr Field kGrabs{2, WireType::kBytes};
  static constexpr Field kContacts{3, WireType::kBytes};
};
struct ContactEvent {
  static constexpr Field kKind{1, WireType::kVarint};
  static constexpr Field kCollider{2, WireType::kBytes};
  static constexpr Field kParticipantId{3, WireType::kVarint};
  static constexpr Field kColliderId{4, WireType::kVarint};
  static constexpr Field kCloth{5, WireType::kBytes};
  static constexpr Field kImpulse{6, WireType::kFixed32};
  static constexpr Field kSeconds{7, WireType::kFixed32};
};
struct GrabEvent {
  static constexpr Field kParticipantId{1, WireType::kVarint};
  static constexpr Field kGrabId{2, WireType::kVarint};
  static constexpr Field kKind{3, WireType::kVarint};
  static constexpr Field kVertices{4, WireType::kVarint};
  static constexpr Field kDistance{5, WireType::kFixed32};
  static constexpr Field kTicksSinceSeen{6, WireType::kVarint};
};
struct DatagramOffer {
  static constexpr Field kUfrag{1, WireType::kBytes};
  static constexpr Field kPassword{2, WireType::kBytes};
  static constexpr Field kFingerprint{3, WireType::kBytes};
  static constexpr Field kSctp{4, WireType::kVarint};
};
struct DatagramAnswer {
  static constexpr Field kUfrag{1, WireType::kBytes};
  static constexpr Field kPassword{2, WireType::kBytes};
  static constexpr Field kFingerprint{3, WireType::kBytes};
  static constexpr Field kAddresses{4, WireType::kBytes};
  static constexpr Field kPort{5, WireType::kVarint};
};
struct SurfaceLimits {
  static constexpr Field kPolicy{1, WireType::kVarint};
  static constexpr Field kMaxTriangles{2, WireType::kVarint};
  static constexpr Field kMaxSurfaces{3, WireType::kVarint};
};
struct SurfaceUpdate {
  static constexpr Field kId{1, WireType::kVarint};
  static constexpr Field kPose{2, WireType::kBytes};
  static constexpr Field kRemove{3, WireType::kVarint};
  static constexpr Field kPart{4, WireType::kBytes};
  static constexpr Field kKeep{5, WireType::kBytes};
};
struct KeptSurfaces {
  static constexpr Field kIds{1, WireType::kBytes};
};
struct SurfacePart {
  static constexpr Field kIndex{1, WireType::kVarint};
  static constexpr Field kCount{2, WireType::kVarint};
  static constexpr Field kPositions{3, WireType::kBytes};
  static constexpr Field kTriangles{4, WireType::kBytes};
  static constexpr Field kTwoSided{5, WireType::kVarint};
  static constexpr Field kFriction{6, WireType::kFixed32};
};
struct RoomSurfaces {
  static constexpr Field kSurfaces{1, WireType::kBytes};
};
struct RoomSurface {
  static constexpr Field kParticipantId{1, WireType::kVarint};
  static constexpr Field kId{2, WireType::kVarint};
  static constexpr Field kRevision{3, WireType::kVarint};
  static constexpr Field kPose{4, WireType::kBytes};
  static constexpr Field kTwoSided{5, WireType::kVarint};
  static constexpr Field kVertexCount{6, WireType::kVarint};
  static constexpr Field kTriangleCount{7, WireType::kVarint};
  static constexpr Field kPartCount{8, WireType::kVarint};
};
struct GetSurfacePartRequest {
  static constexpr Field kParticipantId{1, WireType::kVarint};
  static constexpr Field kId{2, WireType::kVarint};
  static constexpr Field kRevision{3, WireType::kVarint};
  static constexpr Field kIndex{4, WireType::kVarint};
};
struct GetSurfacePartResponse {
  static constexpr Field kPart{1, WireType::kBytes};
};
struct Ping {
  static constexpr Field kClientTimeUs{1, WireType::kVarint};
};
struct Pong {
  static constexpr Field kClientTimeUs{1, WireType::kVarint};
  static constexpr Field kServerTimeUs{2, WireType::kVarint};
};
struct Notice {
  static constexpr Field kKind{1, WireType::kVarint};
  static constexpr Field kText{2, WireType::kBytes};
  static constexpr Field kTick{3, WireType::kVarint};
  static constexpr Field kParticipantId{30, WireType::kVarint};
  static constexpr Field kEndsWithinSeconds{61, WireType::kFixed32};
};
struct Error {
  static constexpr Field kCode{1, WireType::kVarint};
  static constexpr Field kText{2, WireType::kBytes};
  static constexpr Field kFatal{3, WireType::kVarint};
  static constexpr Field kServer{4, WireType::kBytes};
};
struct Moving {
  static constexpr Field kServer{1, WireType::kBytes};
};
struct ListScenesResponse {
  static constexpr Field kScenes{1, WireType::kBytes};
};
struct SceneSummary {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kDescription{2, WireType::kBytes};
  static constexpr Field kVertexCount{3, WireType::kVarint};
  static constexpr Field kClothCount{4, WireType::kVarint};
  static constexpr Field kParticipants{5, WireType::kVarint};
  static constexpr Field kRunning{6, WireType::kVarint};
  static constexpr Field kPaused{7, WireType::kVarint};
  static constexpr Field kCreated{8, WireType::kVarint};
  static constexpr Field kPlayback{50, WireType::kBytes};
  static constexpr Field kRecorded{51, WireType::kVarint};
  static constexpr Field kMaxParticipants{60, WireType::kVarint};
};
struct Playback {
  static constexpr Field kLength{1, WireType::kFixed64};
  static constexpr Field kPosition{2, WireType::kFixed64};
  static constexpr Field kSpeed{3, WireType::kFixed64};
  static constexpr Field kLoop{4, WireType::kVarint};
  static constexpr Field kPaused{5, WireType::kVarint};
};
struct GetSceneRequest {
  static constexpr Field kName{1, WireType::kBytes};
};
struct GetSceneResponse {
  static constexpr Field kScene{1, WireType::kBytes};
};
struct CreateSceneRequest {
  static constexpr Field kScene{1, WireType::kBytes};
  static constexpr Field kUploadedContentId{2, WireType::kVarint};
  static constexpr Field kNamed{3, WireType::kBytes};
  static constexpr Field kName{4, WireType::kBytes};
  static constexpr Field kMaxParticipants{60, WireType::kVarint};
};
struct CreateSceneResponse {
  static constexpr Field kScene{1, WireType::kBytes};
  static constexpr Field kRepairs{70, WireType::kBytes};
};
struct DeleteSceneRequest {
  static constexpr Field kName{1, WireType::kBytes};
};
struct ControlSceneRequest {
  static constexpr Field kName{1, WireType::kBytes};
  static constexpr Field kPaused{2, WireType::kVarint};
  static constexpr Field kReset{3, WireType::kVarint};
  static constexpr Field kSeek{50, WireType::kFixed64};
  static constexpr Field kSpeed{51, WireType::kFixed64};
  static constexpr Field kLoop{52, WireType::kVarint};
};
struct ControlSceneResponse {
  static constexpr Field kScene{1, WireType::kBytes};
};
struct StartRecordingRequest {
  static constexpr Field kScene{1, WireType::kBytes};
  static constexpr Field kName{2, WireType::kBytes};
};
struct StartRecordingResponse {
  static constexpr Field kFile{1, WireType::kBytes};
};
struct StopRecordingRequest {
  static constexpr Field kScene{1, WireType::kBytes};
};
struct StopRecordingResponse {
  static constexpr Field kFile{1, WireType::kBytes};
  static constexpr Field kBytes{2, WireType::kVarint};
};

// clothstream/v1/recording.proto
struct Recovery {
  static constexpr std::uint32_t kNone = 0;
  static constexpr std::uint32_t kRollback = 1;
  static constexpr std::uint32_t kReset = 2;
};
struct AppliedGripState {
  static constexpr std::uint32_t kFree = 0;
  static constexpr std::uint32_t kHolds = 1;
  static constexpr std::uint32_t kTakes = 2;
};
struct ParticipantEventKind {
  static constexpr std::uint32_t kUnspecified = 0;
  static constexpr std::uint32_t kJoined = 1;
  static constexpr std::uint32_t kLeft = 2;
};
struct RecordedScene {
  static constexpr Field kScene{1, WireType::kBytes};
};
struct Checkpoint {
  static constexpr Field kTick{1, WireType::kVarint};
  static constexpr Field kState{2, WireType::kBytes};
  static constexpr Field kRestored{3, WireType::kVarint};
  static constexpr Field kGripsHold{4, WireType::kVarint};
  static constexpr Field kOrigin{6, WireType::kBytes};
  static constexpr Field kHeld{5, WireType::kBytes};
  static constexpr Field kGas{7, WireType::kBytes};
  static constexpr Field kStart{50, WireType::kVarint};
};
struct HeldNodes {
  static constexpr Field kNodes{1, WireType::kBytes};
  static constexpr Field kGrabs{2, WireType::kBytes};
  static constexpr Field kPlaces{3, WireType::kBytes};
  static constexpr Field kTaken{4, WireType::kBytes};
  static constexpr Field kSlipped{5, WireType::kBytes};
  static constexpr Field kOffsets{6, WireType::kBytes};
};
struct RecordedTick {
  static constexpr Field kTick{1, WireType::kVarint};
  static constexpr Field kStateHash{2, WireType::kFixed64};
  static constexpr Field kUnhealthy{3, WireType::kVarint};
  static constexpr Field kRecovery{4, WireType::kVarint};
  static constexpr Field kKeepsState{5, WireType::kVarint};
  static constexpr Field kCloths{6, WireType::kBytes};
  static constexpr Field kGravity{7, WireType::kBytes};
  static constexpr Field kWind{8, WireType::kBytes};
  static constexpr Field kAirDensity{9, WireType::kFixed32};
  static constexpr Field kColliders{10, WireType::kBytes};
  static constexpr Field kAttachments{11, WireType::kBytes};
  static constexpr Field kGrips{12, WireType::kBytes};
  static constexpr Field kCarries{13, WireType::kBytes};
  static constexpr Field kSubsteps{60, WireType::kVarint};
  static constexpr Field kWinds{61, WireType::kBytes};
  static constexpr Field kSurfacesLeftOut{62, WireType::kVarint};
};
struct AppliedCarry {
  static constexpr Field kCloth{1, WireType::kVarint};
  static constexpr Field kFrom{2, WireType::kBytes};
  static constexpr Field kTo{3, WireType::kBytes};
};
struct ClothParameters {
  static constexpr Field kCloth{1, WireType::kBytes};
  static constexpr Field kTakenBack{2, WireType::kFixed32};
};
struct AppliedCollider {
  static constexpr Field kStart{1, WireType::kBytes};
  static constexpr Field kEnd{2, WireType::kBytes};
  static constexpr Field kFriction{3, WireType::kFixed32};
  static constexpr Field kParticipantId{4, WireType::kVarint};
  static constexpr Field kId{5, WireType::kVarint};
  static constexpr Field kSphere{6, WireType::kBytes};
  static constexpr Field kCapsule{7, WireType::kBytes};
  static constexpr Field kPlane{8, WireType::kBytes};
  static constexpr Field kBox{9, WireType::kBytes};
  static constexpr Field kJointsStart{29, WireType::kBytes};
  static constexpr Field kJointsEnd{30, WireType::kBytes};
  static constexpr Field kBefore{31, WireType::kBytes};
  static constexpr Field kJointsBefore{32, WireType::kBytes};
};
struct AppliedGrip {
  static constexpr Field kState{1, WireType::kVarint};
  static constexpr Field kStart{2, WireType::kBytes};
  static constexpr Field kEnd{3, WireType::kBytes};
  static constexpr Field kRadius{4, WireType::kFixed32};
  static constexpr Field kReach{5, WireType::kFixed32};
  static constexpr Field kMaxForce{6, WireType::kFixed32};
  static constexpr Field kSlipDistance{7, WireType::kFixed32};
  static constexpr Field kPlaceNodes{8, WireType::kBytes};
  static constexpr Field kPlaceWeights{9, WireType::kBytes};
  static constexpr Field kLeftAtStart{10, WireType::kFixed32};
  static constexpr Field kLeftAtEnd{11, WireType::kFixed32};
};
struct ParticipantEvent {
  static constexpr Field kParticipantId{1, WireType::kVarint};
  static constexpr Field kKind{2, WireType::kVarint};
  static constexpr Field kClientName{3, WireType::kBytes};
  static constexpr Field kDisplayName{4, WireType::kBytes};
};

}  // namespace clothstream::client::field
