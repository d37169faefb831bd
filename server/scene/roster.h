// SPDX-License-Identifier: MIT
// Participants of a scene: who is in it, and in which role.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "server/delivery/subscribers.h"
#include "server/messages/field_error.h"
#include "server/scene/admission.h"
#include "server/scene/ban_list.h"
#include "server/scene/journal.h"
#include "server/scene/newest_poses.h"
#include "server/scene/ownership.h"
#include "server/scene/participant.h"
#include "server/scene/presence.h"
#include "server/scene/roles.h"
#include "server/scene/scene_observer.h"
#include "server/scene/subject.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

// Part of a roster that is kept beyond the end of the server.
struct SavedRoster {
  std::vector<SavedParticipant> participants;  // in the order in which they joined
  std::vector<Ban> bans;
  std::vector<std::string> refusedTokenHashes;  // of removed participants, newest last
};

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
  // All must outlive the roster. `journal` may be null. They are called under the roster's lock, and must not
  // call the roster.
  Roster(delivery::Subscribers& subscribers, NewestPoses& poses, Journal* journal)
      : subscribers_(subscribers), poses_(poses), journal_(journal) {}

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
  // Removes poses and places whose grace period is over. Call it about once a second.
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

  // Requests of an owner, with the errors of maySetRole() and mayRemove(). remove() with a ban also removes
  // other participants of the same subject. It returns INVALID_ARGUMENT for a participant without a subject.
  [[nodiscard]] messages::Result<void> setRole(const delivery::Mailbox& by, const v1::SetRole& message,
                                               Clock::time_point now);
  [[nodiscard]] messages::Result<void> remove(const delivery::Mailbox& by,
                                              const v1::RemoveParticipant& message, Clock::time_point now);
  // Name of the collider that the mailbox's participant wears; empty for none.
  std::string bodyOf(const delivery::Mailbox& mailbox) const;
  // The participant wears this body from now on; empty: none. Returns PERMISSION_DENIED if its role is too
  // low or another participant wears the body.
  [[nodiscard]] messages::Result<void> wear(const delivery::Mailbox& by, const std::string& body);

 private:
  // The caller of the following holds the lock.
  ParticipantTable::iterator find(const delivery::Mailbox& mailbox);  // end() if nothing is found
  Admission resume(ParticipantRecord& record, const JoinRequest& request,
                   const std::shared_ptr<delivery::Mailbox>& mailbox, Clock::time_point now);
  Admission add(std::uint64_t id, const JoinRequest& request,
                const std::shared_ptr<delivery::Mailbox>& mailbox, Clock::time_point now);
  Admission admissionOf(const ParticipantRecord& record, std::string token, bool resumed) const;
  // Evicts the participant that findLongestAway() finds. Returns false if there is none.
  bool makeRoom(Clock::time_point now, const std::string& address = {});
  // Sets the rights, lowers a role that no owner gave to what they permit, and gives the scene an owner if it
  // has none.
  void limitRole(ParticipantRecord& record, const Rights& rights, Clock::time_point now);
  void changeRole(ParticipantRecord& record, Role role, std::uint64_t by, Clock::time_point now);
  // Gives the scene an owner if it has none.
  void ensureOwner(Clock::time_point now);
  // Ends the participant's session and refuses its resume token from now on. Returns the next participant.
  ParticipantTable::iterator expel(ParticipantTable::iterator record, const char* why, std::uint64_t by,
                                   Clock::time_point now);
  // Returns the next participant. `by` is the participant that caused it, or 0.
  ParticipantTable::iterator erase(ParticipantTable::iterator record, LeaveReason reason, std::uint64_t by,
                                   Clock::time_point now);
  void eraseAll(const delivery::SharedBytes& last);
  // Tells the observer that the participant left.
  void reportLeft(const ParticipantRecord& record, Clock::time_point now);

  delivery::Subscribers& subscribers_;
  NewestPoses& poses_;
  Journal* const journal_;

  mutable std::mutex mutex_;  // held during announcements, so that all subscribers get them in the same order
  ParticipantTable participants_;
  BanList bans_;
  RefusedTokens refusedTokens_;
  DemotedSubjects demoted_;
  bool closed_ = false;
  SceneObserver* observer_ = nullptr;
};

}  // namespace clothstream::scene
