// SPDX-License-Identifier: MIT
#include "server/messages/local_wind.h"

#include <cstddef>
#include <string_view>
#include <unordered_set>
#include <variant>

#include <fmt/format.h>

#include "server/messages/limits.h"
#include "server/messages/vectors.h"

namespace clothstream::messages {
namespace {

float readRadius(Checks& checks, const Path& path, bool given, float value, float initial) {
  return given ? checks.number(path / "radius", value, limits::kWindRadius) : initial;
}

// Fails if the wind would end within its radius.
void checkEnd(Checks& checks, const Path& path, float end, float radius) {
  checks.number(path, end, limits::kWindReach);
  if (!checks.failed() && end < radius)
    checks.fail(path, fmt::format("{}", end),
                fmt::format("must be at least \"radius\", which is {}", radius));
}

model::Fan toFan(Checks& checks, const Path& path, const v1::Fan& message) {
  model::Fan fan;
  fan.radius = readRadius(checks, path, message.has_radius(), message.radius(), fan.radius);
  if (message.has_spread()) fan.spread = checks.number(path / "spread", message.spread(), limits::kSpread);
  if (message.has_range()) fan.range = message.range();
  checkEnd(checks, path / "range", fan.range, fan.radius);
  return fan;
}

model::Vortex toVortex(Checks& checks, const Path& path, const v1::Vortex& message) {
  model::Vortex vortex;
  vortex.radius = readRadius(checks, path, message.has_radius(), message.radius(), vortex.radius);
  if (message.has_reach()) vortex.reach = message.reach();
  checkEnd(checks, path / "reach", vortex.reach, vortex.radius);
  return vortex;
}

model::LocalWind toWind(Checks& checks, const Path& path, const v1::LocalWind& message) {
  model::LocalWind wind{.pose = toPose(checks, path / "pose", message.pose()),
                        .speed = checks.number(path / "speed", message.speed(), limits::kLocalSpeed)};
  switch (message.kind_case()) {
    case v1::LocalWind::kFan:
      wind.kind = toFan(checks, path / "fan", message.fan());
      break;
    case v1::LocalWind::kVortex:
      wind.kind = toVortex(checks, path / "vortex", message.vortex());
      break;
    case v1::LocalWind::KIND_NOT_SET:
      checks.fail(path, "", "has no kind; must have \"fan\" or \"vortex\"");
  }
  return wind;
}

void write(const model::Fan& fan, v1::LocalWind& message) {
  v1::Fan& to = *message.mutable_fan();
  to.set_radius(fan.radius);
  to.set_spread(fan.spread);
  to.set_range(fan.range);
}

void write(const model::Vortex& vortex, v1::LocalWind& message) {
  v1::Vortex& to = *message.mutable_vortex();
  to.set_radius(vortex.radius);
  to.set_reach(vortex.reach);
}

}  // namespace

std::vector<model::SceneWind> toSceneWinds(Checks& checks, const Path& path, const v1::Environment& message) {
  checks.count(path / "winds", static_cast<std::size_t>(message.winds_size()), 0, model::kMaxLocalWinds);
  std::vector<model::SceneWind> winds;
  std::unordered_set<std::string_view> names;
  for (int i = 0; i < message.winds_size() && !checks.failed(); ++i) {
    const v1::LocalWind& from = message.winds(i);
    const Path element = path.at("winds", i);
    winds.push_back({toWind(checks, element, from), checks.name(element / "name", from.name())});
    if (!names.insert(from.name()).second)
      checks.fail(element / "name", '"' + from.name() + '"', "is used twice; names must be unique");
  }
  return winds;
}

model::LocalWind toLocalWind(Checks& checks, const Path& path, const v1::LocalWind& message) {
  if (!message.name().empty())
    checks.failNamed(path / "name", message.name(), "must be empty: only winds of a scene have names");
  return toWind(checks, path, message);
}

void write(const model::SceneWind& wind, v1::LocalWind& message) {
  write(static_cast<const model::LocalWind&>(wind), message);
  message.set_name(wind.name);
}

void write(const model::LocalWind& wind, v1::LocalWind& message) {
  write(wind.pose, *message.mutable_pose());
  message.set_speed(wind.speed);
  std::visit([&](const auto& kind) { write(kind, message); }, wind.kind);
}

}  // namespace clothstream::messages
