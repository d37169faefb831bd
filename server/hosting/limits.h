// SPDX-License-Identifier: MIT
// Limits of a server that follow from the network in which it runs: one table, and the values of one profile.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>

namespace clothstream::hosting {

// home: a private network. open: the internet; its name is public, a reserved word of C++. fleet: behind a
// gateway, which limits what each client may do, and whose address all clients have.
enum class Profile : std::uint8_t { home, open, fleet };
inline constexpr std::array kProfileNames{"home", "public", "fleet"};

// Time at the start of an upload to which minUploadRate does not apply.
inline constexpr std::chrono::seconds kUploadPatience{5};

// Limits of one profile. Limits of one address do not hold for loopback.
struct Limits {
  Limits() : Limits(Profile::home) {}
  explicit Limits(Profile profile);

  // Open connections of one address to each endpoint; new ones per second, of all addresses and of one.
  std::uint32_t connectionsPerAddress = 0;
  double connectionsPerSecond = 0, connectionsPerSecondPerAddress = 0;
  // A peer that has not joined a scene by then is disconnected, even if it sends messages. The time of an
  // upload, at most maxUploadTime, and of creating a scene are added.
  std::chrono::milliseconds helloTimeout{};
  // Megabytes per second that are read from one peer, with a burst of as many. A faster peer waits.
  double maxReadRate = 0;
  // Open connections with tokens of one subject.
  std::uint32_t maxConnectionsPerToken = 0;
  // Share of maxParticipants that one address may have in a scene, rounded up. 1 means no limit.
  double placesPerAddress = 0;
  // True: peers outside a scene may always pause, reset, record and delete it. False: only while it has no
  // owner.
  bool outsideControl = false;
  // Uploads of all peers together and of the peers of one address, and the message of one once it is parsed.
  std::uint64_t maxUploadBytes = 0, maxUploadBytesOfAddress = 0, maxParsedBytes = 0;
  // An upload is dropped after this time, complete or not, unless a scene was created from it. Slower ones
  // are dropped earlier: an upload must have this mean rate in kilobytes per second, after kUploadPatience.
  std::chrono::milliseconds maxUploadTime{};
  double minUploadRate = 0;
  // Nodes, springs and attachments of a scene that a peer creates, and springs of one node of its meshes.
  std::uint64_t maxSceneNodes = 0, maxSceneSprings = 0;
  std::uint32_t maxNodeSprings = 0, maxSceneAttachments = 0;
  // Creating a scene ends with an error after this time.
  std::chrono::milliseconds maxCreationTime{};
  // A created scene is deleted when it has had no participant for this long; 0: never.
  std::chrono::milliseconds sceneLifetime{};
  // Share of one scene in the budgets for the load and the memory of all scenes.
  double sceneShare = 0;
  // Lines of the log per second, of each level.
  double logRate = 0;
};

enum class LimitUnit : std::uint8_t {
  number,
  perSecond,
  share,
  seconds,
  megabytes,
  megabytesPerSecond,
  kilobytesPerSecond,
  allowed  // 0 or 1
};

struct LimitRow {
  const char* what;
  LimitUnit unit;
  std::variant<bool Limits::*, std::uint32_t Limits::*, std::uint64_t Limits::*, double Limits::*,
               std::chrono::milliseconds Limits::*>
      field;
  std::array<double, kProfileNames.size()> values;  // in the unit, in the order of Profile
  const char* option = nullptr;                     // sets the limit alone; null: only the profile does
};

std::span<const LimitRow> limitTable();

// The value with its unit for people, such as "64 MB"; "none" if there is no limit.
std::string valueText(const LimitRow& row, Profile profile);

}  // namespace clothstream::hosting
