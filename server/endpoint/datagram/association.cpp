// SPDX-License-Identifier: MIT
#include "server/endpoint/datagram/association.h"

#include <algorithm>
#include <utility>

#include <spdlog/spdlog.h>

namespace clothstream::endpoint {
namespace {

// Interval in which the end of a path is noticed.
constexpr std::chrono::seconds kCheckInterval{1};

}  // namespace

Association::Association(const AssociationContext& context, ice::Credentials local,
                         hosting::DatagramPeer peer, std::function<void()> wake, Transmit transmit,
                         Admit admit, Time now)
    : ufrag_(local.ufrag),
      now_(now),
      link_(peer, std::move(wake), SecurePath::headerBytes(peer.offer.sctp), context.pieces, context.metrics),
      path_(context.dtls, std::move(local), peer.offer,
            {.transmit = std::move(transmit),
             .deliver = [this](std::span<const std::byte> payload) { link_.receive(payload, now_); },
             .admit = std::move(admit)},
            now) {}

Association::Handled Association::handle(const Address& from, std::span<const std::byte> datagram, Time now) {
  now_ = now;
  if (!(path_.selected(now) == from ? rate_ : unprovenRate_).take(now)) return Handled::dropped;
  if (ice::isStun(datagram)) return path_.handleCheck(from, datagram, now) ? Handled::check : Handled::other;
  path_.handleRecord(from, datagram, now);
  return Handled::other;
}

void Association::advance(Time now) {
  now_ = now;
  checkAt_ = now + kCheckInterval;
  path_.advance(now);
  const bool open = path_.isOpen() && !path_.isOver(now);
  if (open != std::exchange(wasOpen_, open))
    spdlog::debug("{}: datagrams {}", link_.peer().name, open ? "are open" : path_.endReason());
  if (const auto address = path_.selected(now); address && address != std::exchange(address_, address))
    link_.peerMoved(now);
  link_.advance(open, now,
                [&](std::span<const std::byte> payload, bool last) { path_.send(payload, last, now); });
}

Time Association::nextTime() const {
  return std::min({checkAt_, path_.nextTime(), link_.nextTime()});
}

}  // namespace clothstream::endpoint
