// SPDX-License-Identifier: MIT
#include "clients/cli/input_lines.h"

#include <cerrno>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <stdexcept>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <unistd.h>

namespace clothstream::cli {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxLineBytes = 64 * 1024;
constexpr double kMaxAfter = 86'400;  // s

// Wrong content of a line. Does not leave parseInputLine().
struct Wrong : std::runtime_error {
  using std::runtime_error::runtime_error;
};

void allowOnly(const Json& object, const std::string& where, std::initializer_list<std::string_view> keys) {
  if (!object.is_object()) throw Wrong(fmt::format("{} must be an object", where));
  for (const auto& [key, value] : object.items()) {
    bool known = false;
    for (const std::string_view allowed : keys) known = known || key == allowed;
    if (!known)
      throw Wrong(fmt::format("\"{}\" is not a key of {}; use {}", key, where, fmt::join(keys, ", ")));
  }
}

float number(const Json& value, const std::string& where) {
  if (!value.is_number() || !std::isfinite(value.get<float>()))
    throw Wrong(fmt::format("{} must be a number", where));
  return value.get<float>();
}

float number(const Json& object, const char* key, const std::string& where, std::optional<float> absent) {
  if (!object.contains(key)) {
    if (!absent) throw Wrong(fmt::format("{} has no \"{}\"", where, key));
    return *absent;
  }
  return number(object[key], fmt::format("{}.{}", where, key));
}

template <std::size_t n>
std::array<float, n> numbers(const Json& value, const std::string& where) {
  if (!value.is_array() || value.size() != n)
    throw Wrong(fmt::format("{} must be an array of {} numbers", where, n));
  std::array<float, n> out{};
  for (std::size_t i = 0; i < n; ++i) out[i] = number(value[i], where);
  return out;
}

std::array<float, 3> positionOf(const Json& object, const std::string& where) {
  if (!object.contains("position")) throw Wrong(fmt::format("{} has no \"position\"", where));
  return numbers<3>(object["position"], where + ".position");
}

std::optional<std::array<float, 4>> orientationOf(const Json& object, const std::string& where) {
  if (!object.contains("orientation")) return std::nullopt;
  return numbers<4>(object["orientation"], where + ".orientation");
}

// Calls `add` with each element and its place in the line.
template <typename Add>
void forEach(const Json& array, const std::string& where, std::size_t most, const Add& add) {
  if (!array.is_array()) throw Wrong(fmt::format("{} must be an array", where));
  if (array.size() > most)
    throw Wrong(fmt::format("{} has {} elements; at most {} are allowed", where, array.size(), most));
  for (std::size_t i = 0; i < array.size(); ++i) add(array[i], fmt::format("{}[{}]", where, i));
}

cs_own_collider colliderOf(const Json& object, const std::string& where) {
  allowOnly(object, where, {"sphere", "capsule", "box", "position", "orientation"});
  if (object.contains("sphere") + object.contains("capsule") + object.contains("box") != 1)
    throw Wrong(fmt::format("{} must have one of \"sphere\", \"capsule\" and \"box\"", where));
  cs_own_collider collider{};
  const std::array<float, 3> position = positionOf(object, where);
  std::copy(position.begin(), position.end(), collider.position);
  if (const auto orientation = orientationOf(object, where))
    std::copy(orientation->begin(), orientation->end(), collider.orientation);
  if (object.contains("box")) {
    const std::string box = where + ".box";
    allowOnly(object["box"], box, {"size"});
    collider.shape = CS_SHAPE_BOX;
    if (!object["box"].contains("size")) throw Wrong(fmt::format("{} has no \"size\"", box));
    const auto size = numbers<3>(object["box"]["size"], box + ".size");
    std::copy(size.begin(), size.end(), collider.size);
  } else {
    const bool capsule = object.contains("capsule");
    const char* const shape = capsule ? "capsule" : "sphere";
    const std::string place = fmt::format("{}.{}", where, shape);
    const Json& numbersOf = object[shape];
    if (capsule)
      allowOnly(numbersOf, place, {"radius", "length", "topRadius"});
    else
      allowOnly(numbersOf, place, {"radius"});
    collider.shape = capsule ? CS_SHAPE_CAPSULE : CS_SHAPE_SPHERE;
    collider.radius = number(numbersOf, "radius", place, std::nullopt);
    if (capsule) {
      collider.length = number(numbersOf, "length", place, std::nullopt);
      collider.top_radius = number(numbersOf, "topRadius", place, 0);
    }
  }
  return collider;
}

cs_grab grabOf(const Json& object, const std::string& where) {
  allowOnly(object, where, {"id", "position", "orientation", "radius", "reach", "maxForce", "slipDistance"});
  constexpr float kDefault = std::numeric_limits<float>::quiet_NaN();
  cs_grab grab{};
  const Json id = object.value("id", Json(1));
  if (!id.is_number_unsigned() || id.get<std::uint64_t>() > UINT32_MAX)
    throw Wrong(fmt::format("{}.id must be an integer, 0 to {}", where, UINT32_MAX));
  grab.id = id.get<std::uint32_t>();
  const std::array<float, 3> position = positionOf(object, where);
  std::copy(position.begin(), position.end(), grab.position);
  if (const auto orientation = orientationOf(object, where))
    std::copy(orientation->begin(), orientation->end(), grab.orientation);
  grab.radius = number(object, "radius", where, kDefault);
  grab.reach = number(object, "reach", where, kDefault);
  grab.max_force = number(object, "maxForce", where, kDefault);
  grab.slip_distance = number(object, "slipDistance", where, kDefault);
  return grab;
}

InputLine::Head headOf(const Json& object) {
  allowOnly(object, "head", {"position", "orientation", "radius"});
  InputLine::Head head;
  head.position = positionOf(object, "head");
  head.orientation = orientationOf(object, "head");
  head.radius = number(object, "radius", "head", head.radius);
  return head;
}

InputLine::Hand handOf(const Json& joints, std::uint32_t side, const std::string& where) {
  InputLine::Hand hand{.side = side, .joints = {}};
  if (joints.is_null()) return hand;
  forEach(joints, where, CS_HAND_JOINTS, [&](const Json& joint, const std::string& place) {
    const auto four = numbers<4>(joint, place);
    hand.joints.insert(hand.joints.end(), four.begin(), four.end());
  });
  if (joints.size() < CS_HAND_JOINTS - 1)
    throw Wrong(fmt::format("{} has {} joints; use {} (OpenXR) or {} (WebXR)", where, joints.size(),
                            CS_HAND_JOINTS, CS_HAND_JOINTS - 1));
  return hand;
}

bool jumpsOf(const Json& object, const std::string& where) {
  const Json jumps = object.value("jumps", Json(false));
  if (!jumps.is_boolean()) throw Wrong(fmt::format("{}.jumps must be true or false", where));
  return jumps.get<bool>();
}

InputLine::Attachment attachmentOf(const Json& object, const std::string& where) {
  allowOnly(object, where, {"name", "position", "orientation", "jumps"});
  if (!object.contains("name") || !object["name"].is_string())
    throw Wrong(fmt::format("{} must have a \"name\", a text", where));
  return {.name = object["name"].get<std::string>(),
          .position = positionOf(object, where),
          .orientation = orientationOf(object, where),
          .jumps = jumpsOf(object, where)};
}

InputLine::Joints jointsOf(const Json& object, const std::string& where) {
  allowOnly(object, where, {"collider", "poses", "jumps"});
  if (!object.contains("collider") || !object["collider"].is_string())
    throw Wrong(fmt::format("{} must have a \"collider\", a text", where));
  InputLine::Joints joints{
      .collider = object["collider"].get<std::string>(), .poses = {}, .jumps = jumpsOf(object, where)};
  constexpr std::size_t kMost = 128;  // as in Skin of scene.proto
  forEach(object.value("poses", Json::array()), where + ".poses", kMost,
          [&](const Json& pose, const std::string& place) {
            const auto seven = numbers<7>(pose, place);
            joints.poses.insert(joints.poses.end(), seven.begin(), seven.end());
          });
  return joints;
}

// Copies a pose of body tracking: position, and the orientation if `to` has room for one.
template <std::size_t n>
void readTracked(const Json& object, const char* key, std::uint32_t part, cs_tracked_body& body,
                 float (&to)[n]) {
  if (!object.contains(key) || object[key].is_null()) return;
  const std::string where = std::string("body.") + key;
  if constexpr (n == 3) {
    const auto position = numbers<3>(object[key], where);
    std::copy(position.begin(), position.end(), to);
  } else {
    allowOnly(object[key], where, {"position", "orientation"});
    const auto position = positionOf(object[key], where);
    const auto orientation = orientationOf(object[key], where).value_or(std::array<float, 4>{0, 0, 0, 1});
    std::copy(position.begin(), position.end(), to);
    std::copy(orientation.begin(), orientation.end(), to + 3);
  }
  body.parts |= part;
}

cs_tracked_body bodyOf(const Json& object) {
  allowOnly(object, "body",
            {"head", "leftHand", "rightHand", "hips", "leftElbow", "rightElbow", "leftAnkle", "rightAnkle",
             "floor"});
  cs_tracked_body body{};
  body.version = CS_TRACKED_BODY_VERSION;
  readTracked(object, "head", CS_BODY_HEAD, body, body.head);
  if (body.parts == 0) throw Wrong("body has no \"head\"");
  readTracked(object, "leftHand", CS_BODY_LEFT_HAND, body, body.left_hand);
  readTracked(object, "rightHand", CS_BODY_RIGHT_HAND, body, body.right_hand);
  readTracked(object, "hips", CS_BODY_HIPS, body, body.hips);
  readTracked(object, "leftElbow", CS_BODY_LEFT_ELBOW, body, body.left_elbow);
  readTracked(object, "rightElbow", CS_BODY_RIGHT_ELBOW, body, body.right_elbow);
  readTracked(object, "leftAnkle", CS_BODY_LEFT_ANKLE, body, body.left_ankle);
  readTracked(object, "rightAnkle", CS_BODY_RIGHT_ANKLE, body, body.right_ankle);
  body.floor = number(object, "floor", "body", 0);
  return body;
}

InputLine lineOf(const Json& object) {
  allowOnly(object, "a line",
            {"after", "colliders", "grabs", "head", "hands", "attachments", "joints", "wear", "body"});
  InputLine line;
  if (object.contains("after")) {
    line.after = static_cast<double>(number(object["after"], "after"));
    if (line.after < 0 || line.after > kMaxAfter)
      throw Wrong(fmt::format("after must be 0 to {:g} s", kMaxAfter));
  }
  if (object.contains("colliders")) {
    line.colliders.emplace();
    forEach(object["colliders"], "colliders", CS_MAX_COLLIDERS,
            [&](const Json& collider, const std::string& where) {
              line.colliders->push_back(colliderOf(collider, where));
            });
  }
  if (object.contains("grabs")) {
    line.grabs.emplace();
    forEach(object["grabs"], "grabs", CS_MAX_GRABS,
            [&](const Json& grab, const std::string& where) { line.grabs->push_back(grabOf(grab, where)); });
  }
  if (object.contains("head")) {
    line.head.emplace();
    if (!object["head"].is_null()) line.head->emplace(headOf(object["head"]));
  }
  if (object.contains("hands")) {
    const Json& hands = object["hands"];
    allowOnly(hands, "hands", {"left", "right"});
    if (hands.contains("left")) line.hands.push_back(handOf(hands["left"], CS_HAND_LEFT, "hands.left"));
    if (hands.contains("right")) line.hands.push_back(handOf(hands["right"], CS_HAND_RIGHT, "hands.right"));
  }
  if (object.contains("attachments")) {
    constexpr std::size_t kMost = 64;  // as in ColliderPoses of session.proto
    forEach(object["attachments"], "attachments", kMost,
            [&](const Json& attachment, const std::string& where) {
              line.attachments.push_back(attachmentOf(attachment, where));
            });
  }
  if (object.contains("joints")) {
    constexpr std::size_t kMost = 8;  // as in ColliderPoses of session.proto
    forEach(object["joints"], "joints", kMost, [&](const Json& joints, const std::string& where) {
      line.joints.push_back(jointsOf(joints, where));
    });
  }
  if (object.contains("wear")) {
    if (!object["wear"].is_string() && !object["wear"].is_null())
      throw Wrong("wear must be the name of a collider, or null, which gives the body back");
    line.wear = object["wear"].is_null() ? "" : object["wear"].get<std::string>();
  }
  if (object.contains("body")) line.body = bodyOf(object["body"]);
  return line;
}

// Names of the colliders that can be worn.
std::string bodiesOf(const cs_client* client) {
  std::vector<std::string> names;
  cs_collider collider;
  for (std::uint32_t i = 0; cs_get_collider(client, i, &collider) != 0; ++i)
    if (cs_is_body(client, i) != 0) names.emplace_back(collider.name);
  return names.empty() ? "this scene has no bodies" : fmt::format("use {}", fmt::join(names, ", "));
}

}  // namespace

tl::expected<void, std::string> InputLine::send(cs_client* client, std::uint64_t nowUs) const {
  if (colliders)
    cs_set_colliders(client, colliders->data(), static_cast<std::uint32_t>(colliders->size()), nowUs);
  if (grabs) cs_set_grabs(client, grabs->data(), static_cast<std::uint32_t>(grabs->size()), nowUs);
  if (head) {
    const bool present = head->has_value();
    cs_set_head(client, present ? (*head)->position.data() : nullptr,
                present && (*head)->orientation ? (*head)->orientation->data() : nullptr,
                present ? (*head)->radius : 0, nowUs);
  }
  for (const Hand& hand : hands)
    cs_set_hand(client, hand.side, hand.joints.data(), static_cast<std::uint32_t>(hand.joints.size() / 4),
                nowUs);
  for (const Attachment& attachment : attachments)
    cs_move_attachment(client, attachment.name.c_str(), attachment.position.data(),
                       attachment.orientation ? attachment.orientation->data() : nullptr,
                       attachment.jumps ? 1 : 0, nowUs);
  for (const Joints& moved : joints)
    cs_move_joints(client, moved.collider.c_str(), moved.poses.data(),
                   static_cast<std::uint32_t>(moved.poses.size() / 7), moved.jumps ? 1 : 0, nowUs);
  if (wear && cs_wear(client, wear->c_str()) == 0)
    return tl::unexpected(
        fmt::format("wear: \"{}\" is not a body of the scene; {}", *wear, bodiesOf(client)));
  return {};
}

tl::expected<InputLine, std::string> parseInputLine(std::string_view line) {
  const Json object = Json::parse(line, nullptr, /*allow_exceptions=*/false);
  if (object.is_discarded()) return tl::unexpected(std::string("is not JSON"));
  try {
    return lineOf(object);
  } catch (const Wrong& wrong) {
    return tl::unexpected(std::string(wrong.what()));
  }
}

tl::expected<InputLines, std::string> InputLines::open(const std::string& path) {
  const bool standard = path == "-";
  const int file = standard ? dup(STDIN_FILENO) : ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return tl::unexpected(fmt::format("cannot read {}: {}", path, std::strerror(errno)));
  return InputLines(file, standard ? "standard input" : path);
}

InputLines::InputLines(InputLines&& other) noexcept
    : file_(std::exchange(other.file_, -1)),
      path_(std::move(other.path_)),
      text_(std::move(other.text_)),
      ended_(other.ended_),
      number_(other.number_),
      waiting_(std::move(other.waiting_)),
      last_(other.last_) {}

InputLines::~InputLines() {
  if (file_ >= 0) close(file_);
}

tl::expected<void, std::string> InputLines::read() {
  pollfd waiting{.fd = file_, .events = POLLIN, .revents = 0};
  if (poll(&waiting, 1, 0) <= 0) return {};
  const std::size_t before = text_.size();
  text_.resize(before + kMaxLineBytes);
  const ssize_t count = ::read(file_, text_.data() + before, kMaxLineBytes);
  text_.resize(before + static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
  if (count == 0) ended_ = true;
  if (count < 0 && errno != EAGAIN && errno != EINTR)
    return tl::unexpected(fmt::format("cannot read {}: {}", path_, std::strerror(errno)));
  return {};
}

std::optional<std::string> InputLines::takeLine() {
  const std::size_t end = text_.find('\n');
  if (end == std::string::npos && !(ended_ && !text_.empty())) return std::nullopt;
  std::string line = text_.substr(0, end);
  text_.erase(0, end == std::string::npos ? end : end + 1);
  ++number_;
  return line;
}

std::string InputLines::place() const {
  return fmt::format("{}, line {}", path_, number_);
}

tl::expected<std::optional<InputLine>, std::string> InputLines::next(
    std::chrono::steady_clock::time_point now) {
  if (!last_) last_ = now;
  while (!waiting_) {
    std::optional<std::string> line = takeLine();
    if (!line && !ended_) {
      if (text_.size() <= kMaxLineBytes)
        if (auto done = read(); !done) return tl::unexpected(std::move(done).error());
      line = takeLine();
    }
    if ((line ? line->size() : text_.size()) > kMaxLineBytes)
      return tl::unexpected(
          fmt::format("{}, line {}: has more than {} bytes", path_, number_ + (line ? 0 : 1), kMaxLineBytes));
    if (!line) return std::nullopt;
    if (line->find_first_not_of(" \t\r") == std::string::npos) continue;
    auto parsed = parseInputLine(*line);
    if (!parsed) return tl::unexpected(fmt::format("{}, line {}: {}", path_, number_, parsed.error()));
    waiting_ = std::move(*parsed);
  }
  const auto due = *last_ + std::chrono::duration_cast<std::chrono::steady_clock::duration>(
                                std::chrono::duration<double>(waiting_->after));
  if (due > now) return std::nullopt;
  // The time that the line names, not that of this call, so that delays do not add up.
  last_ = waiting_->after > 0 ? due : now;
  return std::exchange(waiting_, std::nullopt);
}

}  // namespace clothstream::cli
