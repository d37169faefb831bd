// SPDX-License-Identifier: MIT
#include "tests/attack/victim.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include "clients/datagram/datagram_session.h"
#include "clients/datagram/datagram_transport.h"
#include "clients/grpc/grpc_client.h"
#include "clients/load/link.h"
#include "clients/load/participant.h"

namespace clothstream::attack {
namespace {

using namespace std::chrono_literals;
using SteadyClock = std::chrono::steady_clock;

double toSeconds(SteadyClock::duration time) {
  return std::chrono::duration<double>(time).count();
}

}  // namespace

// Thread-safe.
class Victim::Counts {
 public:
  void begin() {
    const std::lock_guard lock(mutex_);
    frames_ = 0;
    longestGap_ = {};
    begun_ = newest_ = SteadyClock::now();
  }
  void add(std::uint64_t frames) {
    const auto now = SteadyClock::now();
    const std::lock_guard lock(mutex_);
    frames_ += frames;
    longestGap_ = std::max(longestGap_, now - newest_);
    newest_ = now;
  }
  std::uint64_t frames() const {
    const std::lock_guard lock(mutex_);
    return frames_;
  }
  Seen seen() const {
    const std::lock_guard lock(mutex_);
    const auto now = SteadyClock::now();
    return {.framesPerSecond = static_cast<double>(frames_) / toSeconds(now - begun_),
            .longestGap = toSeconds(std::max(longestGap_, now - newest_))};
  }

 private:
  mutable std::mutex mutex_;
  std::uint64_t frames_ = 0;
  SteadyClock::time_point begun_ = SteadyClock::now(), newest_ = begun_;
  SteadyClock::duration longestGap_{};
};

class Victim::Client {
 public:
  Client(const ServerAddress& address, Endpoint endpoint, bool datagrams, Counts& counts) {
    if (endpoint == Endpoint::web)
      joinWeb(address, datagrams, counts);
    else
      joinGrpc(address, datagrams, counts);
  }

  // Frames in datagrams so far.
  std::uint64_t inDatagrams() const {
    const auto statistics = grpc_ ? grpc_->datagrams() : participant_->datagrams();
    return statistics ? statistics->frames : 0;
  }

 private:
  void joinGrpc(const ServerAddress& address, bool datagrams, Counts& counts) {
    auto joined = NativeClient::join(
        address, withDatagrams(makeGrpcTransport(address), datagrams ? Datagrams::required : Datagrams::off),
        {}, [&counts](cs_client*, std::uint32_t events) {
          if ((events & CS_EVENT_FRAME) != 0) counts.add(1);
        });
    if (!joined) throw std::runtime_error("the victim cannot join: " + joined.error().text);
    grpc_ = std::move(*joined);
  }

  void joinWeb(const ServerAddress& address, bool datagrams, Counts& counts) {
    constexpr auto kPatience = 60s;
    // Much shorter than the gaps that count.
    static constexpr auto kInterval = 5ms;
    links_ = load::makeWebLinks(address);
    load::ParticipantOptions options{
        .scene = "", .name = "victim", .token = address.token, .decodes = false, .moves = true};
    if (datagrams) host_ = std::make_unique<DatagramHost>();
    options.datagrams = host_.get();
    options.requiresDatagrams = datagrams;
    participant_ = std::make_unique<load::Participant>(*links_, options);
    for (const auto end = SteadyClock::now() + kPatience; !participant_->joined();) {
      if (const auto why = participant_->ended())
        throw std::runtime_error("the victim cannot join: " + why->text);
      if (SteadyClock::now() > end) throw std::runtime_error("the victim cannot join: no answer");
      participant_->step(SteadyClock::now());
      std::this_thread::sleep_for(kInterval);
    }
    counter_ = std::jthread([this, &counts](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        participant_->step(SteadyClock::now());
        if (const std::uint64_t frames = participant_->take().frames; frames > 0) counts.add(frames);
        std::this_thread::sleep_for(kInterval);
      }
    });
  }

  std::unique_ptr<NativeClient> grpc_;
  std::unique_ptr<load::Links> links_;
  std::unique_ptr<DatagramHost> host_;
  std::unique_ptr<load::Participant> participant_;
  std::jthread counter_;
};

Victim::Victim(const ServerAddress& address, Endpoint endpoint, bool datagrams)
    : counts_(std::make_unique<Counts>()),
      client_(std::make_unique<Client>(address, endpoint, datagrams, *counts_)) {}

Victim::~Victim() = default;

void Victim::begin() {
  counts_->begin();
  datagramsBefore_ = client_->inDatagrams();
}

Victim::Seen Victim::seen() const {
  const auto frames = static_cast<double>(client_->inDatagrams() - datagramsBefore_);
  Seen seen = counts_->seen();
  const double all = static_cast<double>(counts_->frames());
  seen.inDatagrams = all > 0 ? std::min(frames / all, 1.0) : 0;
  return seen;
}

}  // namespace clothstream::attack
