// SPDX-License-Identifier: MIT
// What a client says (proto/clothstream/v1/session.proto), serialised. Each function replaces what `out`
// holds and reuses its memory.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/wire/parameter_change.h"
#include "clients/core/wire/server_message.h"

namespace clothstream::client {

struct ColliderChange {
  std::string_view name;
  const Vec3* position = nullptr;
  const float* radius = nullptr;
};

// Who joins what.
struct Greeting {
  std::string scene, clientName, displayName;
  std::uint32_t role = 0;
  OperatingPoint wanted = {};  // at most
  // Of who comes back: what the Welcome before said. Empty and 0: it does not, or holds no description.
  std::string token;
  std::uint64_t contentId = 0;
  std::uint32_t attempt = 1;  // counts connections
};

void writeHello(std::string& out, std::uint64_t requestId, const Greeting& greeting);
struct AttachmentPose {
  std::string name;
  std::array<float, 3> position{};
  std::array<float, 4> orientation{};  // all zero: not turned
};

// What this participant does.
struct Poses {
  std::vector<cs_own_collider> colliders;  // their ids are their places
  std::vector<float> leftHand, rightHand;  // {x, y, z, radius} of each joint; empty: none
  std::vector<cs_grab> grabs;
  std::vector<AttachmentPose> attachments;
  bool wantsContacts = false;
};
// `serverTimeUs`: the same time on the server's clock; 0: not known.
void writeColliderPoses(std::string& out, const Poses& poses, std::uint64_t clientTimeUs,
                        std::uint64_t serverTimeUs);
void writeParameterChange(std::string& out, std::uint64_t requestId, const ParameterChange& change);
void writeColliderChange(std::string& out, std::uint64_t requestId, const ColliderChange& change);
void writePing(std::string& out, std::uint64_t requestId, std::uint64_t clientTimeUs);
void writeFrameAck(std::string& out, std::uint64_t tick);
// `early`: what comes until then can be decoded.
void writeKeyFrameRequest(std::string& out, std::uint32_t epoch, bool early);
void writeSetRole(std::string& out, std::uint64_t requestId, std::uint64_t participant, std::uint32_t role);
void writeRemoveParticipant(std::string& out, std::uint64_t requestId, std::uint64_t participant);
void writeListScenes(std::string& out, std::uint64_t requestId);
// Of a scene's clock; what is not given stays.
struct SceneControl {
  std::optional<bool> paused{};
  std::optional<double> seek{}, speed{};
  std::optional<bool> loop{};
};
void writeControlScene(std::string& out, std::uint64_t requestId, std::string_view scene,
                       const SceneControl& control);

}  // namespace clothstream::client
