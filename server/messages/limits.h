// SPDX-License-Identifier: MIT
// Limits of values from outside. proto/parameters has the limits of parameters that can change while a scene
// runs.
#pragma once

#include <cstddef>
#include <cstdint>

#include "proto/parameters/cloth_parameters.h"
#include "server/model/closed_mesh.h"
#include "server/model/stability.h"

namespace clothstream::messages {

using parameters::Range;

namespace limits {

inline constexpr std::uint32_t kMaxRate = 1000;  // ticks/s
inline constexpr std::uint32_t kMaxSubsteps = model::kMaxSubsteps;
inline constexpr std::size_t kMaxCloths = 256;
// Cloths that the elements of one ParameterChange address together.
inline constexpr std::size_t kMaxAddressedCloths = 16 * kMaxCloths;
inline constexpr std::size_t kMaxColliders = 64;
inline constexpr std::size_t kMaxPins = 4096;                    // ranges per cloth
inline constexpr std::uint64_t kMaxSelectionTests = 67'108'864;  // per scene, of a node and a range or region
inline constexpr std::size_t kMaxAttachments = 64;               // per scene
inline constexpr std::size_t kMaxMotionKeys = 1024;              // per collider
inline constexpr std::size_t kMinHullParts = 4;                  // vertices, faces
inline constexpr std::size_t kMaxHullParts = 128;
inline constexpr std::size_t kMaxSolids = 8;  // colliders of a scene that are meshes
inline constexpr std::size_t kMaxSolidVertices = 3 * model::kMaxClosedMeshTriangles;
inline constexpr std::size_t kMaxJoints = model::kMaxJoints;  // of a mesh
inline constexpr std::size_t kMaxAnimationPoses = 16'384;     // keys times joints, of a mesh
inline constexpr std::uint32_t kMinGridNodes = 2;             // per row or column
inline constexpr std::uint32_t kMaxGridNodes = 8192;
inline constexpr std::uint64_t kMaxNodes = 16'777'216;  // per scene
inline constexpr std::uint32_t kMaxNodeSprings = 1024;  // of one node of a mesh
inline constexpr std::size_t kMaxNameLength = 64;
inline constexpr std::size_t kMaxTextBytes = 1024;
inline constexpr std::size_t kMaxLabelBytes = 64;

inline constexpr Range kPosition{-1000, 1000};    // m
inline constexpr Range kGridLength{0.001, 1000};  // m
inline constexpr double kMinSpacing = 0.0001;     // m; also of a mesh's edges
inline constexpr Range kScale{1e-6, 1e6};         // m per unit
inline constexpr Range kDistanceCell{5e-4, 10};   // m
inline constexpr Range kWeldDistance{0, 0.1};     // m
inline constexpr Range kRegionLength{0, 1000};    // m
inline constexpr Range kSkinDistance{0, 1000};    // m, of a node from its skinned place, and of a backstop
inline constexpr Range kMass{1e-6, 1e6};          // kg
inline constexpr Range kArealMass{1e-4, 1000};    // kg/m^2
inline constexpr Range kFriction = parameters::kFriction;
inline constexpr Range kRadius{0.001, 1000};           // m
inline constexpr Range kShapeLength{0, 1000};          // m
inline constexpr Range kShapeSize{0.001, 1000};        // m
inline constexpr Range kParticipantRadius{0.001, 10};  // m
inline constexpr Range kParticipantLength{0, 10};      // m
inline constexpr Range kParticipantSize{0.001, 10};    // m
inline constexpr Range kJointRadius{0.001, 0.1};       // m
inline constexpr double kMaxHandReach = 0.5;           // m, distance of a joint from its wrist
inline constexpr Range kMotionTime{0, 86400};          // s
inline constexpr Range kMaxError{0.00001, 0.1};        // m
inline constexpr std::uint32_t kMaxQualities = 4;
inline constexpr Range kGrabRadius{0.001, 1};     // m
inline constexpr Range kGrabReach{0, 1};          // m
inline constexpr Range kGrabForce{0.001, 1e6};    // N
inline constexpr Range kSlipDistance{0.001, 10};  // m
inline constexpr Range kLocalSpeed{0, 100};       // m/s, of a local wind
inline constexpr Range kWindRadius{0.05, 10};     // m, of a fan, or of the core of a vortex
inline constexpr Range kWindReach{0.05, 1000};    // m
inline constexpr Range kSpread{0, 1};
inline constexpr std::uint32_t kMaxSolverNodes = 1'048'576;  // per cloth
inline constexpr std::uint64_t kMaxAssembledNodes = 65'536;  // per scene, in cloths with an assembled system
inline constexpr std::uint64_t kMaxAssembledEntries =
    256;  // per node of a cloth with an assembled system; 20 bytes each
inline constexpr std::uint32_t kMinCoarseCells = 2, kMaxCoarseCells = 16;
inline constexpr std::uint32_t kMaxCoarseSweeps = 16;
inline constexpr std::uint32_t kMaxCoarseLevels = 2;
inline constexpr std::uint32_t kMaxCoarseEvery = 64;              // substeps
inline constexpr std::uint32_t kMaxSelfCollisionNodes = 524'288;  // per scene
inline constexpr std::uint32_t kMaxBoundNodes = 65'536;  // per scene, in cloths that nothing passes through
inline constexpr double kUnitTolerance = 0.001;          // deviation of a quaternion's length from 1

inline constexpr float kDefaultWeldDistance = 1e-5f;  // m
inline constexpr float kDefaultArealMass = 0.2f;      // kg/m^2
inline constexpr std::uint32_t kDefaultStreamRate = 72;

inline constexpr std::size_t kMaxSceneFileBytes = 4 * 1024 * 1024;
inline constexpr std::size_t kMaxMeshFileBytes = 512 * 1024 * 1024;
inline constexpr std::size_t kMaxClientMessageBytes = 64 * 1024;
inline constexpr std::size_t kMaxParticipantColliders = 60;  // includes the bones of hands
inline constexpr std::size_t kMaxParticipantGrabs = 10;
inline constexpr std::size_t kMaxParticipantWinds = 2;
inline constexpr std::uint32_t kMaxSurfaceParts = 4096;  // of the mesh of a surface
inline constexpr std::size_t kMaxKeptSurfaces = 4096;    // ids
inline constexpr std::size_t kMaxChunkBytes = 256 * 1024;
inline constexpr std::size_t kMaxContentBytes = 256 * 1024 * 1024;
inline constexpr std::size_t kMaxParsedBytes = 128'000'000;  // of a content, in memory
// Geometry of all cloths in a description. The remaining bytes of the content are for everything else.
inline constexpr std::size_t kMaxGeometryBytes = kMaxContentBytes - 8 * 1024 * 1024;

}  // namespace limits
}  // namespace clothstream::messages
