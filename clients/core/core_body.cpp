// SPDX-License-Identifier: MIT
// C interface: bodies that participants wear.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>

#include "clients/core/core.h"
#include "clients/core/core_handle.h"

using namespace clothstream::client;

namespace {

bool allFinite(std::span<const float> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](float number) { return std::isfinite(number); });
}

// Mesh of a collider of the scene; nullptr if it has none.
const Hull* meshOf(const cs_client* client, std::uint32_t index) {
  const Collider* collider = at(client->client.colliders(), index);
  const bool isOfScene = collider && collider->participantId == 0;
  return isOfScene ? hullOf(*collider, client->client.stream().description()) : nullptr;
}

body::Point trackedPoint(const float* numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

// nullopt if a number of a tracked part is not finite, or the head is not tracked.
std::optional<body::Tracked> trackedOf(const cs_tracked_body& from) {
  const auto has = [&](std::uint32_t part) { return (from.parts & part) != 0; };
  if (!has(CS_BODY_HEAD) || !std::isfinite(from.floor) || !allFinite(from.head)) return std::nullopt;
  body::Tracked tracked{.head = body::frameOf(from.head), .floor = from.floor};
  const auto readFrame = [&](std::uint32_t part, std::span<const float> numbers, auto& to) {
    if (has(part)) to = body::frameOf(numbers.data());
    return !has(part) || allFinite(numbers);
  };
  const auto readPoint = [&](std::uint32_t part, std::span<const float> numbers, auto& to) {
    if (has(part)) to = trackedPoint(numbers.data());
    return !has(part) || allFinite(numbers);
  };
  const bool read = readFrame(CS_BODY_LEFT_HAND, from.left_hand, tracked.hands[0]) &&
                    readFrame(CS_BODY_RIGHT_HAND, from.right_hand, tracked.hands[1]) &&
                    readPoint(CS_BODY_HIPS, from.hips, tracked.hips) &&
                    readPoint(CS_BODY_LEFT_ELBOW, from.left_elbow, tracked.elbows[0]) &&
                    readPoint(CS_BODY_RIGHT_ELBOW, from.right_elbow, tracked.elbows[1]) &&
                    readPoint(CS_BODY_LEFT_ANKLE, from.left_ankle, tracked.ankles[0]) &&
                    readPoint(CS_BODY_RIGHT_ANKLE, from.right_ankle, tracked.ankles[1]);
  return read ? std::optional(tracked) : std::nullopt;
}

}  // namespace

int cs_is_body(const cs_client* client, uint32_t collider) noexcept {
  const Hull* mesh = meshOf(client, collider);
  return mesh && body::findHumanoid(*mesh) ? 1 : 0;
}

int cs_wear(cs_client* client, const char* collider) noexcept {
  return client->client.wear(collider ? collider : "") ? 1 : 0;
}

const char* cs_body_of(const cs_client* client, uint64_t participant_id) noexcept {
  return client->client.participants().bodyOf(participant_id).c_str();
}

int cs_set_body(cs_client* client, const cs_tracked_body* tracked, uint64_t now_us) noexcept {
  if (tracked->version != CS_TRACKED_BODY_VERSION) return 0;
  const std::optional<body::Tracked> known = trackedOf(*tracked);
  return known && client->client.moveBody(*known, now_us) ? 1 : 0;
}

int cs_get_body_part(const cs_client* client, uint32_t part, float* pose7) noexcept {
  const body::WornBody* worn = client->client.worn();
  if (!worn || worn->poses().empty()) return 0;
  const std::optional<body::Frame> frame = worn->solver().partAt(part);
  if (!frame) return 0;
  body::write(*frame, pose7);
  return 1;
}

const float* cs_body_joints(const cs_client* client, uint32_t* count) noexcept {
  const body::WornBody* worn = client->client.worn();
  *count = worn ? static_cast<std::uint32_t>(worn->poses().size() / kJointNumbers) : 0;
  return *count > 0 ? worn->poses().data() : nullptr;
}

const uint32_t* cs_body_below_neck(const cs_client* client, uint32_t collider,
                                   uint32_t* index_count) noexcept {
  const Hull* mesh = meshOf(client, collider);
  const std::optional<body::Humanoid> humanoid = mesh ? body::findHumanoid(*mesh) : std::nullopt;
  client->belowNeck = humanoid ? body::trianglesBelowNeck(*humanoid, *mesh) : std::vector<std::uint32_t>();
  *index_count = static_cast<std::uint32_t>(client->belowNeck.size());
  return client->belowNeck.empty() ? nullptr : client->belowNeck.data();
}
