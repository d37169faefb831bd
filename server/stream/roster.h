// SPDX-License-Identifier: MIT
// Who takes part in a scene: roles, presence, and places that are kept for those who were cut off.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"
#include "server/model/input.h"
#include "server/stream/audience.h"
#include "server/stream/clock.h"
#include "server/stream/inbox.h"
#include "server/stream/journal.h"
#include "server/stream/roles.h"

namespace clothstream::stream {

// What becomes of a participant whose connection is lost: its colliders and grabs stay where they are for
// `still`, and vanish then; its place is kept for `hold`.
struct Holding {
  Clock::duration hold = std::chrono::seconds(60);
  Clock::duration still = std::chrono::seconds(2);
};

// Of a scene, those who are held included, unless the server or who creates the scene says otherwise.
inline constexpr std::uint32_t kDefaultMaxParticipants = 64;

// Thread-safe. Whoever is in the audience is in here too, but the audience has no mailbox of who is away. A
// participant's connection is known by its mailbox; one that has lost its participant, by whatever happened
// meanwhile, changes nothing.
//
// As long as somebody else than viewers is there, the scene has an owner: the first who joins, and where the
// last one leaves, the participant who is there for longest.
class Roster {
 public:
  static constexpr std::size_t kTokenBytes = 16;
  // Poses that say that they will be true later than this are taken to say no time; those from before are
  // taken to be this old.
  static constexpr std::chrono::milliseconds kMostAhead{100}, kMostBehind{10'000};

  // All outlive it; `journal` may be null.
  Roster(Audience& audience, Inbox& inbox, Journal* journal)
      : audience_(audience), inbox_(inbox), journal_(journal) {}

  struct Newcomer {
    std::string clientName, displayName;
    v1::Role role = v1::ROLE_UNSPECIFIED;  // wanted
    std::string token;                     // of who comes back; else empty
    std::uint32_t attempt = 0;             // grows with its connections
  };
  struct Admission {
    std::uint64_t id = 0;
    v1::Role role = v1::ROLE_UNSPECIFIED;
    std::string token;
    bool resumed = false;
    std::vector<v1::Participant> participants;  // all, in the order in which they joined
  };
  enum class Refusal : std::uint8_t { full, closed, late };

  // Who has the token of somebody here becomes that participant, and the connection that this one had ends;
  // unless that is of a later attempt. Others join anew, with the next of `ids`, unless `limit` are here;
  // somebody who is away makes room. From here on the mailbox is told of every change.
  [[nodiscard]] tl::expected<Admission, Refusal> join(const Newcomer& newcomer,
                                                      const std::shared_ptr<Mailbox>& mailbox,
                                                      std::atomic<std::uint64_t>& ids, std::size_t limit,
                                                      Clock::time_point now);
  // For good.
  void leave(const Mailbox& mailbox, v1::LeaveReason reason, Clock::time_point now);
  // It may come back.
  void lose(const Mailbox& mailbox, const Holding& holding, Clock::time_point now);
  // Those whose time is over leave, and lose their colliders and grabs before. To be called now and then.
  void expire(Clock::time_point now);
  // Everybody leaves with this as the last message, and what they did and no tick has seen yet is dropped.
  // close(): and nobody joins from here on.
  void dismiss(const SharedBytes& last);
  void close(const SharedBytes& last);

  // Those who are away included, and they alone.
  std::size_t size() const;
  std::size_t away() const;
  // Whether somebody, who may be away, owns the scene.
  bool owned() const;

  // Puts what the participant does into the inbox, `message` as `poses`; or says which role it takes.
  [[nodiscard]] messages::Result<void> post(const Mailbox& mailbox, const v1::ColliderPoses& message,
                                            model::ParticipantPoses poses, const Permissions& permissions,
                                            Clock::time_point arrival);
  // Whether the participant may do that: an Act, or a message of which permit() tells.
  template <typename What>
  [[nodiscard]] messages::Result<void> permits(const Mailbox& mailbox, const What& what,
                                               const Permissions& permissions) const {
    return permit(roleOf(mailbox), what, permissions);
  }

  // What an owner asks for. NOT_FOUND where there is no such participant.
  [[nodiscard]] messages::Result<void> setRole(const Mailbox& by, const v1::SetRole& message,
                                               Clock::time_point now);
  [[nodiscard]] messages::Result<void> remove(const Mailbox& by, const v1::RemoveParticipant& message,
                                              Clock::time_point now);

 private:
  struct Entry {
    v1::Participant told;
    std::string token;
    std::uint32_t attempt = 0;                // of its newest connection
    std::shared_ptr<Mailbox> mailbox;         // null: it is away
    model::ParticipantPoses poses;            // the newest, without attachments
    bool posed = false;                       // the scene has colliders or grabs of it, perhaps
    Clock::time_point vanishes{}, expires{};  // of who is away
  };
  using Entries = std::vector<Entry>;

  // end() where there is none.
  Entries::iterator find(const Mailbox& mailbox);
  Entries::iterator find(const std::string& token);
  v1::Role roleOf(const Mailbox& mailbox) const;
  // The participant that an owner speaks of.
  messages::Result<Entry*> target(const char* field, std::uint64_t id);
  Admission resume(Entry& entry, const std::shared_ptr<Mailbox>& mailbox, Clock::time_point now);
  // Called when the others were told of it: its Welcome tells it itself.
  void listen(const std::shared_ptr<Mailbox>& mailbox);
  // Whose time would be over first of those who are away leaves. False where nobody is away.
  bool makeRoom(Clock::time_point now);
  // Gives the next one.
  Entries::iterator erase(Entries::iterator entry, v1::LeaveReason reason, std::uint64_t by,
                          Clock::time_point now);
  void vanish(Entry& entry, Clock::time_point now);
  void changeRole(Entry& entry, v1::Role role, std::uint64_t by, Clock::time_point now);
  void findOwner(Clock::time_point now);
  Admission admissionOf(const Entry& entry, bool resumed) const;
  void clear();
  void announce(v1::PresenceKind kind, const v1::Participant& participant, std::uint64_t by = 0,
                v1::LeaveReason reason = v1::LEAVE_REASON_UNSPECIFIED);

  Audience& audience_;
  Inbox& inbox_;
  Journal* const journal_;

  mutable std::mutex mutex_;  // held while others are told, so that everybody is told in one order
  Entries entries_;           // in the order in which they joined
  bool closed_ = false;
};

}  // namespace clothstream::stream
