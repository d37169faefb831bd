// SPDX-License-Identifier: MIT
// Reasons for which the server refuses something; docs/limits.md has the limits.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace clothstream::telemetry {

enum class Refusal : std::uint8_t {
  connections,           // too many are open
  connectionsOfAddress,  // too many of this address are open
  connectionRate,        // too many new ones per second
  connectionRateOfAddress,
  stopping,          // the server stops
  handshake,         // TLS was not agreed on
  callRate,          // too many calls per second from one address
  createdScenes,     // too many scenes exist
  budget,            // the price of a scene exceeds the remaining budget
  helloTimeout,      // a connection did not join a scene in time
  silence,           // a connection sent nothing for too long
  unreadAnswers,     // a client does not read its answers
  messageRate,       // too many messages of one kind, or frames of a WebSocket
  messageSize,       // a message from a client is too large
  answerSize,        // an answer is too large for a stream
  uploads,           // no room for an upload
  uploadTime,        // an upload took too long
  waitingScenes,     // too many scenes wait to be created
  creationTime,      // creating a scene took too long
  sceneSize,         // too many nodes, springs or attachments, or too large a message
  participants,      // the scene is full
  colliders,         // the price of the participants' colliders exceeds the remaining budget
  parameterChanges,  // too many changes of a scene
  diskShare,         // recordings have used their share of the disk
  token,             // no token, or one that is not valid
  pairingCode,       // a wrong pairing code
  connectionsOfToken,
  scenesOfTenant,
  unreadCalls,  // answers of calls that clients have not read yet
  requestRate,  // too many HTTP requests per second from one address
};

// Names for metrics and reports, in the order of Refusal.
inline constexpr std::array<std::string_view, 30> kRefusalNames{"connections",
                                                                "connections of address",
                                                                "connection rate",
                                                                "connection rate of address",
                                                                "stopping",
                                                                "handshake",
                                                                "call rate",
                                                                "created scenes",
                                                                "budget",
                                                                "hello timeout",
                                                                "silence",
                                                                "unread answers",
                                                                "message rate",
                                                                "message size",
                                                                "answer size",
                                                                "uploads",
                                                                "upload time",
                                                                "waiting scenes",
                                                                "creation time",
                                                                "scene size",
                                                                "participants",
                                                                "colliders",
                                                                "parameter changes",
                                                                "disk share",
                                                                "token",
                                                                "pairing code",
                                                                "connections of token",
                                                                "scenes of tenant",
                                                                "unread calls",
                                                                "request rate"};
static_assert(kRefusalNames.size() == static_cast<std::size_t>(Refusal::requestRate) + 1);

}  // namespace clothstream::telemetry
