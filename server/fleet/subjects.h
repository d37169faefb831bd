// SPDX-License-Identifier: MIT
// Subjects of the messages between servers (fleet.proto).
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace clothstream::fleet {

inline constexpr const char* kOffers = "clothstream.scenes";

// Part that the subjects of one stream have in common, without a dot at its end.
std::string streamSubject(const std::string& scene, std::uint64_t stream);

std::string framesSubject(const std::string& stream, std::uint8_t quality);
// Frames of this quality, or of all qualities.
std::string framesPattern(const std::string& stream, std::optional<std::uint8_t> quality);
std::string eventsSubject(const std::string& stream);
std::string interestSubject(const std::string& stream);
std::string descriptionSubject(const std::string& stream);

// A participant on an edge, both of them random numbers.
struct TunnelId {
  std::uint64_t edge = 0, peer = 0;
  auto operator<=>(const TunnelId&) const = default;
};
// Segments to the origin of a stream, and to an edge.
std::string upSubject(const std::string& stream, const TunnelId& tunnel);
std::string downSubject(const std::string& stream, const TunnelId& tunnel);
// Subjects of all participants, and of all participants on an edge.
std::string upPattern(const std::string& stream);
std::string downPattern(const std::string& stream, std::uint64_t edge);
// Reads the end of either subject.
std::optional<TunnelId> tunnelOf(const std::string& subject);

// Answers to the programs of a role. Only they may subscribe to what begins with it, so that an edge does not
// see answers to a server.
std::string inboxSubject(const std::string& role);
bool isInbox(std::string_view subject);
// Requests to a server.
std::string serverSubject(std::uint64_t origin);
// Both directions of a move.
std::string moveUpSubject(std::uint64_t move);
std::string moveDownSubject(std::uint64_t move);

}  // namespace clothstream::fleet
