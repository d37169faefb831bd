// SPDX-License-Identifier: MIT
// A scene as its participants share it: definition, inbox, audience, metrics. Where endpoints and the
// device's thread meet.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "server/messages/field_error.h"
#include "server/model/scene.h"
#include "server/stream/audience.h"
#include "server/stream/frame_source.h"
#include "server/stream/inbox.h"
#include "server/stream/journal.h"
#include "server/stream/roster.h"
#include "server/telemetry/metrics.h"

namespace clothstream::stream {

// Thread-safe.
class LiveScene {
 public:
  // Must be valid. `created`: while the server runs, by a peer. `journal`: of all that happens in it; may be
  // null. `maxParticipants`: those who are held included.
  explicit LiveScene(model::Scene definition, bool created = false,
                     std::shared_ptr<Journal> journal = nullptr,
                     std::uint32_t maxParticipants = kDefaultMaxParticipants);
  // One that is not simulated: the source is yet to begin. Its start() and definition() hold name and rates
  // alone.
  LiveScene(std::string name, std::shared_ptr<FrameSource> source,
            std::uint32_t maxParticipants = kDefaultMaxParticipants);
  ~LiveScene();

  const std::string& name() const { return start_.name; }
  // As it was at first.
  const model::Scene& start() const { return start_; }
  // Of its stream.
  std::uint32_t codec() const;
  StreamShape shape() const;
  // With all accepted changes, those of the next tick included.
  model::Scene definition() const;

  // Checks the change against the definition and puts it into the inbox, or says what is wrong with it.
  messages::Result<void> change(std::uint64_t participant, const v1::ParameterChange& message);
  // Environment and cloths as at first, and changes of them that were on their way dropped; returns the
  // change that says so.
  v1::ParameterChange resetParameters();

  // Its simulation is gone, and the next one begins as the first did: all is as at first, and all changes
  // that were on their way are dropped; returns the change that says so.
  v1::ParameterChange beginAnew();

  // The definition becomes what holds now and the changes that wait; returns the change that says what holds.
  v1::ParameterChange correct(const model::Scene& now);

  // For who joins now; must have joined the audience before, so as to miss no change.
  std::shared_ptr<const Description> description();

  // Of its stream; the first and only one while a server runs.
  static constexpr std::uint32_t kEpoch = 1;

  const bool created;
  const std::uint32_t maxParticipants;
  const std::shared_ptr<Journal> journal;     // null: none is kept
  const std::shared_ptr<FrameSource> source;  // null: the device's thread
  std::atomic<bool> paused{false};            // its clock is stopped, but for a reset's first frame
  std::atomic<bool> resetWanted{false};       // taken at the next tick

  Inbox inbox;
  Audience audience;
  Roster roster;
  telemetry::SceneMetrics metrics;

  // Written by the device's thread.
  std::atomic<bool> running{false};
  std::atomic<std::uint64_t> tick{0};  // newest complete one

 private:
  const model::Scene start_;
  const std::shared_ptr<const std::string> cloths_;  // of all descriptions

  mutable std::mutex mutex_;
  model::Scene definition_;
  std::shared_ptr<const Description> description_;  // null when the definition has changed since
  std::uint64_t contents_ = 0;                      // ids given
};

// Tells that a scene's clock is stopped; by whom, see notice().
SharedBytes pausedNotice(const LiveScene& scene, std::uint64_t participant = 0);

}  // namespace clothstream::stream
