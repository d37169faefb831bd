// SPDX-License-Identifier: MIT
#include "server/messages/grab_place.h"

#include <cstdint>

#include <fmt/format.h>

#include "server/model/mesh.h"

namespace clothstream::messages {
namespace {

// A sum of rounded coordinates may exceed 1 by this.
constexpr float kSumTolerance = 1e-4f;

}  // namespace

model::GrabPlace toGrabPlace(Checks& checks, const Path& path, const v1::GrabPlace& message,
                             const model::Scene& scene) {
  model::GrabPlace place{.point = {.cloth = message.cloth(),
                                   .triangle = message.triangle(),
                                   .second = checks.number(path / "second", message.second(), {0, 1}),
                                   .third = checks.number(path / "third", message.third(), {0, 1})},
                         .seenTick = message.seen_tick()};
  checks.integer(path / "cloth", place.point.cloth, 0, static_cast<std::uint32_t>(scene.cloths.size() - 1));
  if (checks.failed()) return place;
  checks.integer(path / "triangle", place.point.triangle, 0,
                 model::triangleCount(scene.cloths[place.point.cloth]) - 1);
  if (const float sum = place.point.second + place.point.third; sum > 1 + kSumTolerance)
    checks.fail(path, fmt::format("second + third = {}", sum), "must be at most 1");
  return place;
}

void write(const model::GrabPlace& place, v1::GrabPlace& message) {
  message.set_cloth(place.point.cloth);
  message.set_triangle(place.point.triangle);
  message.set_second(place.point.second);
  message.set_third(place.point.third);
  message.set_seen_tick(place.seenTick);
}

}  // namespace clothstream::messages
