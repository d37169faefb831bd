// SPDX-License-Identifier: MIT
// Participants of a scene: roles, presence, and reconnection.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "server/delivery/subscribers.h"
#include "server/messages/field_error.h"
#include "server/model/input.h"
#include "server/scene/ban_list.h"
#include "server/scene/collider_shares.h"
#include "server/scene/inbox.h"
#include "server/scene/journal.h"
#include "server/scene/roles.h"
#include "server/scene/scene_observer.h"
#include "server/scene/subject.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

// Grace periods after a participant's connection is lost. Its colliders and grabs stay for `poses`, its place
// in the scene for `place`, or for `page` after its page was closed, which may reload; the shorter one
// counts.
struct ReconnectGrace {
  Clock::duration place = std::chrono::seconds(60);
  Clock::duration page = std::chrono::seconds(20);
  Clock::duration poses = std::chrono::seconds(2);
};

struct Participant {
  std::uint64_t id = 0;
  std::string displayName, clientName;
  Role role = Role::none;
  bool away = false;  // disconnected; it may come back
};
void write(const Participant& participant, v1::Participant& message);

// Whether a participant becomes an owner without another owner's help.
enum class Ownership : std::uint8_t {
  never,
  ifNone,  // while the scene has no owner
  always,
};

// Permissions of a participant's identity in a scene.
struct Rights {
  Ownership ownership = Ownership::ifNone;
  bool onlyViews = false;  // viewer is its only role

  // Highest role without an owner's help.
  Role highest() const {
    if (onlyViews) return Role::viewer;
    return ownership == Ownership::never ? Role::participant : Role::owner;
  }
};

// A participant as it is kept beyond the end of the server.
struct SavedParticipant {
  Participant participant;
  std::string tokenHash;      // hashOfToken() of its resume token
  Subject subject;            // of its identity; empty without one
  std::uint32_t attempt = 0;  // of its newest session
  bool grantedRole = false;   // an owner gave it a higher role than its identity permits
  bool ownsByToken = false;   // its token has the role owner
};

// Part of a roster that is kept beyond the end of the server.
struct SavedRoster {
  std::vector<SavedParticipant> participants;  // in the order in which they joined
  std::vector<Ban> bans;
  std::vector<std::string> refusedTokenHashes;  // of removed participants, newest last
};

enum class LeaveReason : std::uint8_t { left, timedOut, removed };

// Thread-safe. The subscribers hold the mailboxes of all connected participants; a participant that is away
// has none. A session is identified by its mailbox. If its participant is gone, or was taken over by another
// session, calls for that mailbox have no effect.
//
// If the scene has no owner, the first participant to join that may own it becomes one. When the last owner
// leaves, it is the one of these that has been there longest. Viewers own nothing.
//
// A role that no owner gave is at most the one that the identity permits, also after a return or a new token.
// A role that an owner gave stays. The roster remembers whom an owner made a viewer: the subject of that
// participant is a viewer again when it joins again.
class Roster {
 public:
  static constexpr std::size_t kTokenBytes = 16;
  // Resume tokens of removed participants that are refused; the oldest are forgotten.
  static constexpr std::size_t kMaxRefusedTokens = 256;
  // Subjects that stay viewers; the oldest are forgotten.
  static constexpr std::size_t kMaxDemoted = 256;
  // Accepted range of pose times. Later times count as unknown, earlier ones as kMaxBehind.
  static constexpr std::chrono::milliseconds kMaxAhead{100}, kMaxBehind{10'000};

  // All must outlive the roster. `journal` may be null. Without `budget` there is room for all colliders.
  Roster(delivery::Subscribers& subscribers, Inbox& inbox, Journal* journal, ColliderBudget* budget = nullptr)
      : subscribers_(subscribers), inbox_(inbox), journal_(journal), budget_(budget) {}

  struct JoinRequest {
    std::string clientName{}, displayName{};
    Role role = Role::none;     // requested
    std::string token{};        // of a participant that reconnects; else empty
    Subject subject{};          // of the peer's identity; empty without one
    Rights rights{};            // of the peer's identity
    std::uint32_t attempt = 0;  // grows with each connection of the participant
    std::string address{};      // of the peer; empty: its places are not limited
    std::size_t placesOfAddress = std::numeric_limits<std::size_t>::max();
  };
  struct Admission {
    std::uint64_t id = 0;
    Role role = Role::none;
    std::string token;
    bool resumed = false;
    std::vector<Participant> participants;  // all, in the order in which they joined
  };
  enum class Refusal : std::uint8_t { full, addressHasMany, closed, late, removed };

  // Adds the mailbox to the subscribers. A request with the token of a participant resumes that participant
  // and closes its former session; it is refused as late if that session has a higher attempt number. The
  // subject must be the same. A banned subject, or the token of a removed participant, is refused as removed.
  // Other requests get the next number of `ids`. If there are `limit` participants, the one that has been
  // away longest is evicted (in a tie, the one with the lowest role). If none is away, the request is refused
  // as full. The same holds among the participants of one address, if they have `placesOfAddress` places.
  //
  // An exception, for example for a lack of memory, removes a new participant again. A participant that
  // returned then counts as disconnected.
  [[nodiscard]] tl::expected<Admission, Refusal> join(const JoinRequest& request,
                                                      const std::shared_ptr<delivery::Mailbox>& mailbox,
                                                      std::atomic<std::uint64_t>& ids, std::size_t limit,
                                                      Clock::time_point now);
  // The participant's identity has other rights now, because it has sent a new token.
  void renew(const delivery::Mailbox& mailbox, const Rights& rights, Clock::time_point now);
  // Removes the participant for good.
  void leave(const delivery::Mailbox& mailbox, LeaveReason reason, Clock::time_point now);
  // The connection is lost: the participant is away and may come back.
  void disconnect(const delivery::Mailbox& mailbox, const ReconnectGrace& grace, Clock::time_point now);
  // Removes poses and places whose grace period is over, and divides the room for colliders again. Call it
  // about once a second.
  void expire(Clock::time_point now);
  // Removes all participants, with this as their last message, and drops the poses that no tick has used.
  void dismiss(const delivery::SharedBytes& last);
  // Same as dismiss(), and refuses every later join().
  void close(const delivery::SharedBytes& last);

  // The observer is told who joins and leaves from now on. It must outlive the roster, or the observation.
  void observe(SceneObserver& observer);
  // The observer is not called any more after the return. `everyoneLeaves`: it is first told that all
  // participants left; otherwise they continue somewhere else, or in a later run of the server.
  void endObservation(bool everyoneLeaves);

  // Whether a participant has this resume token.
  bool knows(const std::string& token) const;

  SavedRoster saved() const;
  // Adds participants of an earlier run as if they were disconnected now, bans and refused tokens. The roster
  // must be empty.
  void restore(const SavedRoster& saved, const ReconnectGrace& grace, Clock::time_point now);

  // The grace of all participants that are away begins now, as if they were disconnected now.
  void restartGrace(const ReconnectGrace& grace, Clock::time_point now);

  // Number of all participants, and of those that are away.
  std::size_t size() const;
  std::size_t away() const;
  // Returns whether the scene has an owner, who may be away.
  bool owned() const;

  // Puts the participant's poses into the inbox. `poses` is the content of `message`. Returns an error if the
  // role is too low. Participants share the budget of colliders evenly, hands and heads first: colliders
  // beyond the participant's share do not act, and an error says so when that begins. The same holds for
  // joints that the budget refuses.
  [[nodiscard]] messages::Result<void> post(const delivery::Mailbox& mailbox,
                                            const v1::ColliderPoses& message, model::ParticipantPoses poses,
                                            const Permissions& permissions, Clock::time_point arrival);
  // Role::none if the mailbox is not of a participant.
  Role roleOf(const delivery::Mailbox& mailbox) const;
  // Calls permit() with the participant's role. `What` is an Action or a message.
  template <typename What>
  [[nodiscard]] messages::Result<void> permits(const delivery::Mailbox& mailbox, const What& what,
                                               const Permissions& permissions) const {
    return permit(roleOf(mailbox), what, permissions);
  }

  // Bans of the scene. They are lifted by LiftBan, or end with the scene.
  std::vector<Ban> bans() const;
  void setBans(std::vector<Ban> bans);
  bool isBanned(const Subject& subject) const;
  // Lifts the bans of subjects with this name, of every tenant. Returns whether there was one.
  bool liftBan(const std::string& name);

  // Requests of an owner. They return NOT_FOUND if there is no such participant, and PERMISSION_DENIED for an
  // owner by token (Ownership::always) if the sender is not one. remove() with a ban also removes other
  // participants of the same subject. It returns INVALID_ARGUMENT for a participant without a subject.
  [[nodiscard]] messages::Result<void> setRole(const delivery::Mailbox& by, const v1::SetRole& message,
                                               Clock::time_point now);
  [[nodiscard]] messages::Result<void> remove(const delivery::Mailbox& by,
                                              const v1::RemoveParticipant& message, Clock::time_point now);

 private:
  struct Entry {
    Participant participant;
    std::string tokenHash;  // hashOfToken() of the resume token
    Subject subject;
    Rights rights;
    bool grantedRole = false;                         // as in SavedParticipant
    std::uint32_t attempt = 0;                        // of the newest session
    model::ParticipantPoses poses;                    // the newest, without attachments
    bool posed = false;                               // the scene may have colliders or grabs of it
    ColliderLoad needs, uses;                         // of the colliders in `poses`, while posed
    std::size_t acting = 0;                           // number of them that the scene has
    bool limited = false;                             // the newest message had more
    bool jointsRefused = false;                       // those of the newest message with joints
    Clock::time_point posesExpire{}, placeExpires{};  // while it is away
    Clock::time_point connectedSince{};               // while it is not away
    Clock::duration connected{};                      // before
    std::string address;                              // as in JoinRequest
  };
  using Entries = std::vector<Entry>;
  enum class Presence : std::uint8_t { joined, roleChanged, disconnected, returned };

  // Both return end() if nothing is found.
  Entries::iterator find(const delivery::Mailbox& mailbox);
  Entries::iterator find(const std::string& token);
  bool isRefused(const std::string& token) const;
  // Ends the participant's session and refuses its resume token from now on. Returns the next entry.
  Entries::iterator expel(Entries::iterator entry, const char* why, std::uint64_t by, Clock::time_point now);
  bool isDemoted(const Subject& subject) const;
  void rememberRole(const Subject& subject, Role role);
  // Sets the rights, lowers a role that no owner gave to what they permit, and gives the scene an owner if it
  // has none.
  void limitRole(Entry& entry, const Rights& rights, Clock::time_point now);
  // Returns PERMISSION_DENIED if the participant is an owner by token and the sender is not.
  messages::Result<void> mayActOn(const char* field, const Entry& by, const Entry& entry) const;
  // Participant that an owner's request names in `field`.
  messages::Result<Entries::iterator> target(const char* field, std::uint64_t id);
  Admission resume(Entry& entry, const JoinRequest& request,
                   const std::shared_ptr<delivery::Mailbox>& mailbox, Clock::time_point now);
  // Evicts the participant that has been away longest; in a tie, the one with the lowest role. Returns false
  // if all are connected. With an address only its participants count.
  bool makeRoom(Clock::time_point now, const std::string& address = {});
  std::size_t placesOf(const std::string& address) const;
  // Returns the next entry. `by` is the participant that caused it, or 0.
  Entries::iterator erase(Entries::iterator entry, LeaveReason reason, std::uint64_t by,
                          Clock::time_point now);
  // The participant counts as disconnected.
  static void setAway(Entry& entry, Clock::time_point now);
  // Tells the observer that the participant left.
  void reportLeft(const Entry& entry, Clock::time_point now);
  void removePoses(Entry& entry, Clock::time_point now);
  // Largest weight that the colliders of one participant may have.
  ColliderLoad shareOfEach() const;
  // Removes colliders beyond the participant's share, and charges the others.
  void limit(Entry& entry, std::vector<model::ParticipantCollider>& colliders);
  // Divides the room again, because cloth has moved, or participants have come or gone.
  void divideAgain(Clock::time_point now);
  void charge();
  void changeRole(Entry& entry, Role role, std::uint64_t by, Clock::time_point now);
  // Gives the scene an owner if it has none.
  void ensureOwner(Clock::time_point now);
  Admission admissionOf(const Entry& entry, std::string token, bool resumed) const;
  void clear();
  void announce(Presence presence, const Participant& participant, std::uint64_t by = 0);
  void announceLeft(const Participant& participant, LeaveReason reason, std::uint64_t by);

  delivery::Subscribers& subscribers_;
  Inbox& inbox_;
  Journal* const journal_;
  ColliderBudget* const budget_;

  mutable std::mutex mutex_;  // held during announcements, so that all subscribers get them in the same order
  Entries entries_;           // in the order in which they joined
  ColliderLoad share_;        // of each participant's colliders; found when a need changes, and every second
  BanList bans_;
  std::deque<std::string> refusedTokens_;  // hashes of those of removed participants, newest last
  std::deque<Subject> demoted_;            // made viewers by an owner, newest last
  bool closed_ = false;
  SceneObserver* observer_ = nullptr;
};

}  // namespace clothstream::scene
