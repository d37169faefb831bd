// SPDX-License-Identifier: MIT
// One thread steps all clients. The threads of the Links handle received messages.
#include "clients/load/load.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <thread>

#include "clients/load/created_scenes.h"
#include "clients/load/hostile_client.h"
#include "clients/load/hung_scene.h"

namespace clothstream::load {
namespace {

// Pose interval. At 71 poses a second and 72 ticks a second, poses fall evenly on all times between two
// ticks.
constexpr std::chrono::duration<double> kStep{1.0 / 71};
// Time for the last participant to join, and to create a scene.
constexpr std::chrono::seconds kJoinTime{30};
// Time for the goodbye of a participant that leaves.
constexpr std::chrono::seconds kLeaveTime{2};
constexpr std::chrono::milliseconds kLeavePause{5};

Clock::duration inSeconds(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

class Load {
 public:
  Load(Links& links, const LoadOptions& options, const LoadProgress& progress)
      : links_(links), options_(options), progress_(progress) {
    report_.participants = options.participants;
    report_.slow = options.slow;
    report_.hostileClients = options.hostileClients;
    report_.scenes.wanted = options.scenes;
    if (options.datagrams != Datagrams::off) host_.emplace().sctp = options.sctp;
    if (options.scenes > 0) scenes_.emplace(links, options.token, hungScene(options.nodes, options.rate));
    for (std::uint32_t i = 0; i < options.hostileClients; ++i)
      hostileClients_.push_back(std::make_unique<HostileClient>(links, sceneOf(i), i, options.token));
  }

  LoadReport run() {
    if (gather()) {
      for (Seat& seat : seats_) seat.participant->take();
      progress_.gathered();
      measure();
      progress_.measured();
      for (Seat& seat : seats_) {
        collect(seat);
        if (const auto datagrams = seat.participant->datagrams()) {
          ++report_.withDatagrams;
          add(report_.datagrams, *datagrams);
        }
        if (isSlow(seat)) continue;
        const auto addMs = [](std::vector<float>& to, std::optional<double> seconds) {
          if (seconds) to.push_back(static_cast<float>(1000 * *seconds));
        };
        addMs(report_.joinToFrameMs, seat.participant->firstFrameSeconds());
        addMs(report_.joinToDatagramFrameMs, seat.participant->firstDatagramFrameSeconds());
        if (report_.seconds > 0)
          report_.participantRates.push_back(
              static_cast<float>(static_cast<double>(seat.frames) / report_.seconds));
      }
      for (const auto& client : hostileClients_) report_.visits += client->visits();
    }
    if (scenes_) deleteScenes();
    return report_;
  }

 private:
  struct Seat {
    std::uint32_t number;
    std::unique_ptr<Participant> participant;
    bool counted = false;      // whether it counts as joined
    bool timed = false;        // whether the time to its first frame is in the report
    std::uint64_t frames = 0;  // received while the test measures
  };
  struct Leaving {
    std::unique_ptr<Participant> participant;
    Clock::time_point until;
  };

  std::uint32_t seats() const { return options_.participants + options_.slow; }
  bool isSlow(const Seat& seat) const { return seat.number >= options_.participants; }

  std::string sceneOf(std::uint32_t number) const {
    return scenes_ ? scenes_->name(number % options_.scenes) : options_.scene;
  }

  std::unique_ptr<Participant> make(std::uint32_t number) {
    return std::make_unique<Participant>(
        links_,
        ParticipantOptions{.scene = sceneOf(number),
                           .name = "load " + std::to_string(++names_),
                           .token = options_.token,
                           .decodes = number < options_.decoders,
                           .moves = number + options_.viewers < options_.participants,
                           .phase = number * std::numbers::phi,
                           .bytesPerSecond = number < options_.participants ? 0 : options_.slowBytesPerSecond,
                           .maxVertices = options_.maxVertices,
                           .keepsFrames = options_.keepsFrames && number < options_.participants,
                           .datagrams = host_ && number < options_.participants ? &*host_ : nullptr,
                           .requiresDatagrams =
                               options_.datagrams == Datagrams::required && number < options_.participants});
  }

  // Returns whether the scene of this seat exists. Takes a step towards creating it if it does not.
  bool hasScene(std::uint32_t number) {
    if (!scenes_) return true;
    const std::uint32_t before = scenes_->count();
    const bool exists = scenes_->exists(number % options_.scenes);
    report_.scenes.created = scenes_->count();
    report_.scenes.failure = scenes_->failure();
    if (scenes_->count() > before) lastCreated_ = Clock::now();
    return exists;
  }

  bool allStream() const {
    return seats_.size() == seats() &&
           std::all_of(seats_.begin(), seats_.end(), [](const Seat& seat) { return seat.counted; }) &&
           report_.scenes.firstFrameMs.size() == options_.scenes;
  }

  // Returns false if the test was ended early, a participant was lost or a scene could not be created.
  bool gather() {
    const auto start = Clock::now();
    const auto end = start + inSeconds(seats() / options_.joinsPerSecond) + kJoinTime;
    while (Clock::now() < std::max(end, lastCreated_ + kJoinTime) || (scenes_ && scenes_->waits())) {
      const double due =
          std::chrono::duration<double>(Clock::now() - start).count() * options_.joinsPerSecond;
      while (seats_.size() < seats() && static_cast<double>(seats_.size()) <= due) {
        const auto number = static_cast<std::uint32_t>(seats_.size());
        if (!hasScene(number)) break;
        seats_.push_back({number, make(number)});
      }
      if (!step()) return false;
      if (report_.lost > 0 || report_.scenes.failure) return false;
      if (allStream()) return true;
    }
    report_.lost += 1;
    report_.firstLoss = {Failure::Kind::lost, "not all participants could join within " +
                                                  std::to_string(kJoinTime.count()) + " s"};
    return false;
  }

  void measure() {
    const auto start = report_.start = Clock::now();
    const auto end = start + inSeconds(options_.seconds);
    auto shown = start;
    std::uint64_t changes = 0;
    while (Clock::now() < end && step()) {
      const std::chrono::duration<double> passed = Clock::now() - start;
      for (; static_cast<double>(changes) < passed.count() * options_.leavesPerSecond - 1; ++changes)
        change(changes);
      report_.seconds = passed.count();
      if (!progress_.show || Clock::now() - shown < std::chrono::seconds(1)) continue;
      shown = Clock::now();
      LoadReport last = report_;
      last.figures = {};
      for (Seat& seat : seats_) {
        const Figures figures = collect(seat);
        if (!isSlow(seat)) last.figures.add(figures);
      }
      last.seconds = 1;
      progress_.show(last);
    }
    report_.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  }

  // One participant leaves and another replaces it.
  void change(std::uint64_t turn) {
    Seat& seat = seats_[turn % seats_.size()];
    collect(seat);
    seat.participant->leave();
    leaving_.push_back({std::move(seat.participant), Clock::now() + kLeaveTime});
    ++report_.left;
    seat.counted = false;
    seat.participant = make(seat.number);
  }

  // Adds what the participant has received since the last time to the report.
  Figures collect(Seat& seat) {
    Figures figures = seat.participant->take();
    for (FrameTime& frame : figures.frameTimes) frame.participant = seat.number;
    (isSlow(seat) ? report_.slowFigures : report_.figures).add(figures);
    seat.frames += figures.frames;
    return figures;
  }

  // The first participant of each created scene shows when the scene streams.
  void timeFirstFrame(Seat& seat) {
    if (seat.timed || seat.number >= options_.scenes) return;
    const std::optional<double> seconds = seat.participant->firstFrameSeconds();
    if (!seconds) return;
    seat.timed = true;
    report_.scenes.firstFrameMs.push_back(
        static_cast<float>(1000 * (scenes_->creationSeconds(seat.number) + *seconds)));
  }

  // The participants leave first, because a scene with an owner may be deleted by its owners alone.
  void deleteScenes() {
    for (const Seat& seat : seats_) seat.participant->leave();
    const auto end = Clock::now() + kLeaveTime;
    while (Clock::now() < end && !std::all_of(seats_.begin(), seats_.end(), [](const Seat& seat) {
             return seat.participant->ended().has_value();
           }))
      std::this_thread::sleep_for(kLeavePause);
    seats_.clear();
    leaving_.clear();
    hostileClients_.clear();
    const CreatedScenes::Remaining remaining = scenes_->remove();
    report_.scenes.remaining = remaining.scenes;
    report_.scenes.whyRemaining = remaining.why;
  }

  bool step() {
    next_ = std::max(next_ + std::chrono::duration_cast<Clock::duration>(kStep), Clock::now());
    std::this_thread::sleep_until(next_);
    const auto now = Clock::now();
    for (Seat& seat : seats_) {
      seat.participant->step(now);
      if (!seat.counted && seat.participant->joined()) {
        seat.counted = true;
        ++report_.joined;
      }
      timeFirstFrame(seat);
      if (const auto why = seat.participant->ended()) {
        if (report_.lost++ == 0) report_.firstLoss = *why;
        collect(seat);
        seat.counted = false;
        seat.participant = make(seat.number);
      }
    }
    for (const auto& client : hostileClients_) client->step(now);
    std::erase_if(leaving_, [&](const Leaving& one) { return one.participant->ended() || now >= one.until; });
    return progress_.running();
  }

  Links& links_;
  const LoadOptions options_;
  const LoadProgress progress_;
  LoadReport report_;
  std::optional<CreatedScenes> scenes_;  // outlives the participants
  std::optional<DatagramHost> host_;     // likewise
  Clock::time_point lastCreated_{};
  std::vector<Seat> seats_;
  std::vector<Leaving> leaving_;
  std::vector<std::unique_ptr<HostileClient>> hostileClients_;
  std::uint64_t names_ = 0;
  Clock::time_point next_ = Clock::now();
};

double rate(double amount, double seconds, std::uint32_t among) {
  return seconds > 0 && among > 0 ? amount / seconds / among : 0;
}

}  // namespace

double LoadReport::framesPerSecond() const {
  return rate(static_cast<double>(figures.frames), seconds, participants);
}
double LoadReport::slowFramesPerSecond() const {
  return rate(static_cast<double>(slowFigures.frames), seconds, slow);
}
double LoadReport::mbitPerSecond() const {
  return rate(static_cast<double>(figures.bytes + slowFigures.bytes) * 8e-6, seconds, 1);
}

double mean(const std::vector<float>& samples) {
  if (samples.empty()) return 0;
  return std::accumulate(samples.begin(), samples.end(), 0.0) / static_cast<double>(samples.size());
}

double percentile(std::vector<float>& samples, double percent) {
  if (samples.empty()) return 0;
  const auto rank = static_cast<std::size_t>(std::ceil(percent / 100 * static_cast<double>(samples.size())));
  const auto at = samples.begin() + static_cast<std::ptrdiff_t>(std::max<std::size_t>(rank, 1) - 1);
  std::nth_element(samples.begin(), at, samples.end());
  return static_cast<double>(*at);
}

LoadReport runLoad(Links& links, const LoadOptions& options, const LoadProgress& progress) {
  return Load(links, options, progress).run();
}

}  // namespace clothstream::load
