// SPDX-License-Identifier: MIT
#include "server/delivery/merged_announcements.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/messages/scene_message.h"

namespace clothstream::delivery {
namespace {

using Body = v1::ServerMessage;

// Messages with the same key are merged.
struct Key {
  Body::BodyCase body = Body::BODY_NOT_SET;
  std::uint64_t id = 0;
  bool operator==(const Key&) const = default;
};

// Notices about the same thing have the same number.
v1::NoticeKind subjectOf(v1::NoticeKind kind) {
  if (kind == v1::NOTICE_KIND_SCENE_RESUMED) return v1::NOTICE_KIND_SCENE_PAUSED;
  if (kind == v1::NOTICE_KIND_RECORDING_STOPPED) return v1::NOTICE_KIND_RECORDING_STARTED;
  return kind;
}

Key keyOf(const Body& message) {
  Key key{message.body_case()};
  if (message.has_presence()) key.id = message.presence().participant().id();
  if (message.has_notice()) key.id = static_cast<std::uint64_t>(subjectOf(message.notice().kind()));
  return key;
}

struct Waiting {
  Key key;
  Body message;
  SharedBytes bytes;  // null if the message was merged and must be serialised
};

auto keyOf(const v1::GrabEvent& event) {
  return std::tuple(event.participant_id(), event.grab_id());
}
auto keyOf(const v1::ContactEvent& event) {
  return std::tuple<std::uint64_t, std::uint32_t, const std::string&, const std::string&>(
      event.participant_id(), event.collider_id(), event.collider(), event.cloth());
}

// Appends the events, each instead of an older one of the same key.
template <typename Event>
void mergeEvents(google::protobuf::RepeatedPtrField<Event>& newer,
                 google::protobuf::RepeatedPtrField<Event>& all) {
  for (Event& event : newer) {
    const auto older =
        std::ranges::find_if(all, [&](const Event& known) { return keyOf(known) == keyOf(event); });
    if (older != all.end()) all.erase(older);
    if (all.size() == static_cast<int>(kMaxMergedEvents)) all.erase(all.begin());
    all.Add()->Swap(&event);
  }
}

// Merges `newer`, which replaces `older`, with it. Returns false if neither is worth sending.
bool merge(Waiting& older, Waiting& newer) {
  Body& message = newer.message;
  if (message.has_parameter_changed()) {
    v1::ParameterChanged& changed = *message.mutable_parameter_changed();
    v1::ParameterChange all = std::move(*older.message.mutable_parameter_changed()->mutable_change());
    messages::mergeChange(changed.change(), all);
    *changed.mutable_change() = std::move(all);
    newer.bytes = nullptr;
  } else if (message.has_presence() && older.message.presence().kind() == v1::PRESENCE_KIND_JOINED) {
    if (message.presence().kind() == v1::PRESENCE_KIND_LEFT) return false;
    message.mutable_presence()->set_kind(v1::PRESENCE_KIND_JOINED);
    newer.bytes = nullptr;
  } else if (message.has_tick_events()) {
    v1::TickEvents& events = *message.mutable_tick_events();
    v1::TickEvents all = std::move(*older.message.mutable_tick_events());
    mergeEvents(*events.mutable_grabs(), *all.mutable_grabs());
    mergeEvents(*events.mutable_contacts(), *all.mutable_contacts());
    all.set_tick(events.tick());
    events = std::move(all);
    newer.bytes = nullptr;
  }
  return true;
}

}  // namespace

std::deque<SharedBytes> merged(const std::deque<SharedBytes>& announcements) {
  std::vector<Waiting> waiting;
  for (const SharedBytes& bytes : announcements) {
    Waiting next{.key = {}, .message = {}, .bytes = bytes};
    if (next.message.ParseFromArray(bytes->data(), static_cast<int>(bytes->size())))
      next.key = keyOf(next.message);
    const auto older = std::ranges::find(waiting, next.key, &Waiting::key);
    bool keeps = true;
    if (older != waiting.end()) {
      keeps = merge(*older, next);
      waiting.erase(older);
    }
    if (keeps) waiting.push_back(std::move(next));
  }
  std::deque<SharedBytes> result;
  for (Waiting& each : waiting)
    result.push_back(each.bytes ? std::move(each.bytes) : serialise(each.message));
  return result;
}

}  // namespace clothstream::delivery
