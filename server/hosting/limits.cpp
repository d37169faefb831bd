// SPDX-License-Identifier: MIT
#include "server/hosting/limits.h"

#include <fmt/format.h>

namespace clothstream::hosting {
namespace {

constexpr double kMegabyte = 1e6;
static_assert(kUploadPatience == std::chrono::seconds(5));  // as a row says
constexpr double kNone = 1e9;  // fits every field, and is more than a server can have of anything

using Unit = LimitUnit;

constexpr LimitRow kTable[] = {
    // what, unit, field, home, public, fleet, option
    {"connections of one address to each port",
     Unit::number,
     &Limits::connectionsPerAddress,
     {64, 32, kNone}},
    {"new connections to each port", Unit::perSecond, &Limits::connectionsPerSecond, {200, 200, 5000}},
    {"the same of one address, TLS handshakes included",
     Unit::perSecond,
     &Limits::connectionsPerSecondPerAddress,
     {20, 10, kNone}},
    {"time to join a scene", Unit::seconds, &Limits::helloTimeout, {10, 5, 10}},
    {"bytes that are read from one stream", Unit::megabytesPerSecond, &Limits::maxReadRate, {16, 4, 16}},
    {"open connections with tokens of one subject",
     Unit::number,
     &Limits::maxConnectionsPerToken,
     {16, 8, 16}},
    {"participants of one address in a scene, as a share of --max-participants",
     Unit::share,
     &Limits::placesPerAddress,
     {0.5, 0.25, 1}},
    {"control of a scene with an owner from outside",
     Unit::allowed,
     &Limits::outsideControl,
     {1, 0, 0},
     "owners-alone"},
    {"memory of all uploads", Unit::megabytes, &Limits::maxUploadBytes, {64, 32, 64}, "max-upload-memory"},
    {"memory of the uploads of one address",
     Unit::megabytes,
     &Limits::maxUploadBytesOfAddress,
     {32, 8, kNone}},
    {"memory of an uploaded scene once it is parsed",
     Unit::megabytes,
     &Limits::maxParsedBytes,
     {128, 64, 128}},
    {"time of an upload, until a scene is created from it",
     Unit::seconds,
     &Limits::maxUploadTime,
     {60, 30, 60}},
    {"least rate of an upload after five seconds",
     Unit::kilobytesPerSecond,
     &Limits::minUploadRate,
     {16, 64, 16}},
    {"nodes of a created scene", Unit::number, &Limits::maxSceneNodes, {262'144, 65'536, 262'144}},
    {"springs of a created scene", Unit::number, &Limits::maxSceneSprings, {4'194'304, 1'048'576, 4'194'304}},
    {"springs of one node of a mesh", Unit::number, &Limits::maxNodeSprings, {1024, 256, 1024}},
    {"attachments of a created scene", Unit::number, &Limits::maxSceneAttachments, {64, 32, 64}},
    {"time to make a scene", Unit::seconds, &Limits::maxCreationTime, {60, 30, 60}},
    {"life of a created scene without participants",
     Unit::seconds,
     &Limits::sceneLifetime,
     {3600, 600, 3600},
     "scene-lifetime"},
    {"share of one scene in --max-load and --max-memory", Unit::share, &Limits::sceneShare, {1, 0.5, 0.5}},
    {"lines of the log, of each level", Unit::perSecond, &Limits::logRate, {100, 50, 100}},
};

template <typename Number>
void assign(Number& field, LimitUnit unit, double value) {
  field = static_cast<Number>(unit == Unit::megabytes ? value * kMegabyte : value);
}

void assign(std::chrono::milliseconds& field, LimitUnit, double value) {
  field = std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::duration<double>(value));
}

}  // namespace

Limits::Limits(Profile profile) {
  for (const LimitRow& row : kTable) {
    const double value = row.values[static_cast<std::size_t>(profile)];
    std::visit([&](auto field) { assign(this->*field, row.unit, value); }, row.field);
  }
}

std::span<const LimitRow> limitTable() {
  return kTable;
}

std::string valueText(const LimitRow& row, Profile profile) {
  const double value = row.values[static_cast<std::size_t>(profile)];
  if (value >= kNone) return "none";
  switch (row.unit) {
    case Unit::number:
      return fmt::format("{}", value);
    case Unit::perSecond:
      return fmt::format("{} a second", value);
    case Unit::share:
      return fmt::format("{} %", 100 * value);
    case Unit::seconds:
      return fmt::format("{} s", value);
    case Unit::megabytes:
      return fmt::format("{} MB", value);
    case Unit::megabytesPerSecond:
      return fmt::format("{} MB a second", value);
    case Unit::kilobytesPerSecond:
      return fmt::format("{} kB a second", value);
    case Unit::allowed:
      return value > 0 ? "yes" : "no";
  }
  return {};
}

}  // namespace clothstream::hosting
