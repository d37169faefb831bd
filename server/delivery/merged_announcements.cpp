// SPDX-License-Identifier: MIT
#include "server/delivery/merged_announcements.h"

#include <compare>
#include <cstdint>
#include <iterator>
#include <list>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include "clothstream/v1/session.pb.h"
#include "server/messages/scene_message.h"

namespace clothstream::delivery {
namespace {

using Body = v1::ServerMessage;

// Messages with the same key are merged.
struct Key {
  Body::BodyCase body = Body::BODY_NOT_SET;
  std::uint64_t id = 0;
  auto operator<=>(const Key&) const = default;
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

// The newest event of each key, in the order of their arrival.
template <typename Event>
class NewestEvents {
 public:
  void add(google::protobuf::RepeatedPtrField<Event>& newer) {
    for (Event& event : newer) {
      if (const auto older = byKey_.find(keyOf(event)); older != byKey_.end()) erase(older);
      if (events_.size() == kMaxMergedEvents) erase(byKey_.find(keyOf(events_.front())));
      events_.emplace_back().Swap(&event);
      byKey_.emplace(keyOf(events_.back()), std::prev(events_.end()));
    }
    newer.Clear();
  }
  void moveTo(google::protobuf::RepeatedPtrField<Event>& all) {
    for (Event& event : events_) all.Add()->Swap(&event);
  }

 private:
  // Keys refer to texts of the events, so they must end first.
  using ByKey = std::map<decltype(keyOf(std::declval<const Event&>())), typename std::list<Event>::iterator>;
  void erase(typename ByKey::iterator known) {
    const auto event = known->second;
    byKey_.erase(known);
    events_.erase(event);
  }

  std::list<Event> events_;
  ByKey byKey_;
};

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
    newer.bytes = nullptr;
  }
  return true;
}

}  // namespace

std::deque<SharedBytes> merged(const std::deque<SharedBytes>& announcements) {
  std::list<Waiting> waiting;
  std::map<Key, std::list<Waiting>::iterator> byKey;
  NewestEvents<v1::GrabEvent> grabs;
  NewestEvents<v1::ContactEvent> contacts;
  for (const SharedBytes& bytes : announcements) {
    Waiting next{.key = {}, .message = {}, .bytes = bytes};
    if (next.message.ParseFromArray(bytes->data(), static_cast<int>(bytes->size())))
      next.key = keyOf(next.message);
    if (next.message.has_tick_events()) {
      grabs.add(*next.message.mutable_tick_events()->mutable_grabs());
      contacts.add(*next.message.mutable_tick_events()->mutable_contacts());
    }
    const auto older = byKey.find(next.key);
    bool keeps = true;
    if (older != byKey.end()) {
      keeps = merge(*older->second, next);
      waiting.erase(older->second);
      byKey.erase(older);
    }
    if (!keeps) continue;
    waiting.push_back(std::move(next));
    byKey.emplace(waiting.back().key, std::prev(waiting.end()));
  }
  std::deque<SharedBytes> result;
  for (Waiting& each : waiting) {
    if (!each.bytes && each.message.has_tick_events()) {
      grabs.moveTo(*each.message.mutable_tick_events()->mutable_grabs());
      contacts.moveTo(*each.message.mutable_tick_events()->mutable_contacts());
    }
    result.push_back(each.bytes ? std::move(each.bytes) : serialise(each.message));
  }
  return result;
}

const std::deque<SharedBytes>& SharedMerges::of(const std::deque<SharedBytes>& announcements) {
  for (const Merge& known : merges_)
    if (known.from == announcements) return known.to;
  return merges_.emplace_back(announcements, merged(announcements)).to;
}

}  // namespace clothstream::delivery
