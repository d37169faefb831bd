// SPDX-License-Identifier: MIT
#include "clients/datagram/association.h"

#include <algorithm>
#include <utility>

namespace clothstream {

using State = dtls::DtlsChannel::State;

Association::Association(const dtls::DtlsContext& context, ice::Credentials local, const DatagramPeer& peer,
                         Callbacks callbacks, Time now)
    : context_(context),
      peerFingerprint_(peer.fingerprint),
      callbacks_(std::move(callbacks)),
      agent_(std::move(local), peer.credentials, peer.addresses, now) {}

void Association::handle(const ice::Address& from, std::span<const std::byte> datagram, Time now) {
  if (ice::isStun(datagram)) {
    send(agent_.handle(from, datagram, now));
  } else if (channel_ && path_ == from) {
    agent_.arrived(now);
    channel_->handle(datagram, now);
  }
  begin(now);
}

void Association::advance(Time now) {
  send(agent_.advance(now));
  if (channel_) channel_->advance(now);
  begin(now);
}

Association::Time Association::nextTime() const {
  return std::min(agent_.nextTime(), channel_ ? channel_->nextTime() : Time::max());
}

void Association::send(std::span<const std::byte> payload, Time now) {
  path_ = agent_.selected(now);
  if (channel_) channel_->send(payload);
}

void Association::close(Time now) {
  path_ = agent_.selected(now);
  if (channel_) channel_->close();
}

bool Association::isOver(Time now) const {
  return agent_.isOver(now) ||
         (channel_ && (channel_->state() == State::failed || channel_->state() == State::closed));
}

std::string Association::why() const {
  if (!channel_) return "no address of the server answers by UDP";
  if (channel_->state() == State::failed) return "the DTLS handshake failed: " + channel_->error();
  if (channel_->state() == State::handshake) return "the DTLS handshake is not complete";
  return "the server has ended them";
}

void Association::send(const std::vector<ice::Datagram>& datagrams) const {
  for (const ice::Datagram& datagram : datagrams) callbacks_.send(datagram.to, datagram.bytes);
}

void Association::begin(Time now) {
  path_ = agent_.selected(now);
  if (!channel_ && path_)
    channel_.emplace(context_, dtls::Role::client, peerFingerprint_,
                     dtls::DtlsChannel::Callbacks{.send =
                                                      [this](std::span<const std::byte> datagram) {
                                                        if (path_) callbacks_.send(*path_, datagram);
                                                      },
                                                  .receive = callbacks_.receive},
                     now);
  hasOpened_ |= channel_ && channel_->state() == State::open;
}

}  // namespace clothstream
