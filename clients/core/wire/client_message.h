// SPDX-License-Identifier: MIT
// Serialises the messages of a client (proto/clothstream/v1/session.proto). Each function replaces the
// content of `out` and reuses its memory. A request id of 0 is omitted.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/wire/description.h"
#include "clients/core/wire/parameter_change.h"
#include "clients/core/wire/server_message.h"
#include "clients/core/wire/skin.h"

namespace clothstream::client {

// Content of Hello: the client and the scene that it joins.
struct Hello {
  std::string scene, clientName, displayName;
  std::uint32_t role = 0;
  std::uint32_t quality = 0;  // finest quality wanted
  // Token and description of the last Welcome, for a client that returns. Empty and 0 if it has none.
  std::string token;
  std::uint64_t contentId = 0;
  std::uint32_t attempt = 1;  // number of this connection
};

// Proof of who the client is: a token, or else a pairing code. Both are empty without a proof.
struct Proof {
  std::string token, pairingCode;
};
void writeAuthenticate(std::string& out, std::uint64_t requestId, const Proof& proof);
void writeCreatePairingCode(std::string& out, std::uint64_t requestId, std::uint32_t role);

void writeHello(std::string& out, std::uint64_t requestId, const Hello& hello);

struct AttachmentPose {
  std::string name;
  std::array<float, 3> position{};
  std::array<float, 4> orientation{};  // x y z w; all zero means no rotation
  bool jumps = false;
};

// Joints of a collider of the scene, relative to their parents: kJointNumbers for each.
struct ColliderJoints {
  std::string collider;
  std::vector<float> poses;
  bool jumps = false;
};

struct OwnGrab {
  cs_grab given{};                     // its pointer to a place is null
  cs_cloth_point point{};              // copy of the place
  std::optional<ClothTriangle> place;  // absent: the grab has no place
};

// Input of this participant.
struct Poses {
  std::vector<cs_own_collider> colliders;  // the id of each is its index
  std::vector<float> leftHand, rightHand;  // {x, y, z, radius} per joint; empty: none
  std::optional<cs_own_collider> head;     // its id is CS_HEAD_ID
  std::vector<OwnGrab> grabs;
  std::vector<AttachmentPose> attachments;
  std::vector<ColliderJoints> joints;
  std::vector<cs_own_wind> winds;  // the id of each is its index
  bool wantsContacts = false, wantsConstraints = false;
};
// Both times are the same instant, on the client's and on the server's clock. serverTimeUs is 0 if unknown.
void writeColliderPoses(std::string& out, const Poses& poses, std::uint64_t clientTimeUs,
                        std::uint64_t serverTimeUs);
void writeParameterChange(std::string& out, std::uint64_t requestId, const ParameterChange& change);
void writeColliderChange(std::string& out, std::uint64_t requestId, std::string_view collider,
                         const cs_collider_change& change);
void writePing(std::string& out, std::uint64_t requestId, std::uint64_t clientTimeUs);
void writeFrameAck(std::string& out, std::uint64_t tick);
// `early`: the client can decode the frames until then.
void writeKeyFrameRequest(std::string& out, std::uint32_t epoch, bool early);
void writeSetRole(std::string& out, std::uint64_t requestId, std::uint64_t participant, std::uint32_t role);
void writeRemoveParticipant(std::string& out, std::uint64_t requestId, std::uint64_t participant, bool ban);
// Place where the collider of a body stands.
struct StandingBody {
  std::string_view collider;
  std::array<float, 3> position{};
  std::array<float, 4> orientation{};  // x y z w
};
// Without a body it is given back.
void writeWearBody(std::string& out, std::uint64_t requestId, const std::optional<StandingBody>& body);
void writeListScenes(std::string& out, std::uint64_t requestId);
// Changes the clock of a scene. Empty members keep their value.
struct SceneControl {
  std::optional<bool> paused{};
  std::optional<double> seek{}, speed{};
  std::optional<bool> loop{};
  bool reset = false;
};
void writeControlScene(std::string& out, std::uint64_t requestId, std::string_view scene,
                       const SceneControl& control);

}  // namespace clothstream::client
