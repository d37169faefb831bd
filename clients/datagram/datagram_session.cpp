// SPDX-License-Identifier: MIT
#include "clients/datagram/datagram_session.h"

#include <algorithm>
#include <cstdint>
#include <exception>
#include <utility>

#include "proto/dtls/digest.h"

namespace clothstream {
namespace {

using SteadyClock = std::chrono::steady_clock;

std::uint64_t microseconds(SteadyClock::duration time) {
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::microseconds>(time).count());
}

// The clock of NativeClient::nowUs().
std::uint64_t nowUs() {
  return microseconds(SteadyClock::now().time_since_epoch());
}

const std::uint8_t* dataOf(std::span<const std::byte> bytes) {
  return reinterpret_cast<const std::uint8_t*>(bytes.data());
}

std::optional<std::span<const std::byte>> viewOf(const std::uint8_t* data, std::size_t bytes) {
  if (!data) return std::nullopt;
  return std::as_bytes(std::span(data, bytes));
}

// Nothing if the answer cannot be used.
std::optional<DatagramPeer> peerOf(const cs_client& client, const cs_datagram_answer& answer,
                                   const std::string& streamAddress, bool sctp) {
  dtls::Digest digest{};
  std::ranges::copy(answer.fingerprint, digest.begin());
  DatagramPeer peer{.credentials = {answer.ufrag, answer.password},
                    .fingerprint = dtls::fingerprintOf(digest),
                    .addresses = {},
                    .sctp = sctp};
  const auto addText = [&](const std::string& text) {
    const auto address = readAddress(text, static_cast<std::uint16_t>(answer.port));
    if (address && std::ranges::find(peer.addresses, *address) == peer.addresses.end())
      peer.addresses.push_back(*address);
  };
  addText(streamAddress);
  for (std::uint32_t i = 0; i < answer.addresses; ++i) addText(cs_datagram_address(&client, i));
  if (peer.addresses.empty() || !ice::isValid(peer.credentials)) return std::nullopt;
  return peer;
}

}  // namespace

void add(cs_datagram_statistics& sum, const cs_datagram_statistics& other) {
  for (const auto count : {&cs_datagram_statistics::packets, &cs_datagram_statistics::lost_packets,
                           &cs_datagram_statistics::parity_packets, &cs_datagram_statistics::frames,
                           &cs_datagram_statistics::repaired_frames, &cs_datagram_statistics::lost_frames,
                           &cs_datagram_statistics::requests, &cs_datagram_statistics::held_frames})
    sum.*count += other.*count;
}

DatagramSession::DatagramSession(DatagramHost& host, std::function<void()> onArrival)
    : host_(host), onArrival_(std::move(onArrival)) {}

void DatagramSession::connecting() {
  close();
  offerAt_ = Time::min();
}

void DatagramSession::close() {
  awaitsAnswer_ = false;
  if (association_) {
    association_->close(SteadyClock::now());
    end("the connection has ended");
  }
  offerAt_ = Time::max();
}

void DatagramSession::negotiate(cs_client& client, const std::function<std::string()>& streamAddress) {
  if (SteadyClock::now() >= offerAt_) offer(client);
  cs_datagram_answer answer;
  if (!awaitsAnswer_ || cs_get_datagram_answer(&client, &answer) == 0) return;
  awaitsAnswer_ = false;
  refused_ = answer.addresses == 0;
  if (refused_) return end("the server opens none for this client");
  if (const auto peer = peerOf(client, answer, streamAddress(), host_.sctp)) return begin(*peer);
  end("the server's answer has no usable address");
}

void DatagramSession::offer(cs_client& client) {
  offerAt_ = Time::max();
  try {
    local_ = ice::randomCredentials();
  } catch (const std::exception& error) {
    return end(error.what());
  }
  cs_datagram_offer made{.version = CS_DATAGRAM_OFFER_VERSION,
                         .ufrag = local_.ufrag.c_str(),
                         .password = local_.password.c_str(),
                         .fingerprint = {},
                         .sctp = host_.sctp ? 1 : 0};
  std::ranges::copy(dtls::digestOf(host_.certificate.fingerprint()), made.fingerprint);
  awaitsAnswer_ = cs_offer_datagrams(&client, &made) != 0;
}

void DatagramSession::begin(const DatagramPeer& peer) {
  try {
    if (!socket_) socket_ = std::make_unique<UdpSocket>(host_.thread, onArrival_);
    link_.reset(cs_create_datagrams());
    association_.emplace(
        host_.context, local_, peer,
        Association::Callbacks{
            .send = [this](const ice::Address& to,
                           std::span<const std::byte> datagram) { socket_->send(to, datagram); },
            .receive =
                [this](std::span<const std::byte> payload) {
                  cs_receive_datagram(link_.get(), dataOf(payload), payload.size(), nowUs());
                }},
        SteadyClock::now());
  } catch (const std::exception& error) {
    end(error.what());
  }
}

void DatagramSession::exchange() {
  if (!association_) return;
  const Time now = SteadyClock::now();
  try {
    for (const ReceivedDatagram& datagram : socket_->take())
      association_->handle(datagram.from, datagram.bytes, now);
    association_->advance(now);
    if (const auto roundTrip = association_->roundTrip())
      cs_set_datagram_round_trip(link_.get(), microseconds(*roundTrip));
    std::size_t bytes = 0;
    while (const std::uint8_t* datagram = cs_next_datagram(link_.get(), nowUs(), &bytes))
      association_->send(std::as_bytes(std::span(datagram, bytes)), now);
    hasOpened_ |= association_->hasOpened();
    if (association_->isOver(now)) end(association_->why());
  } catch (const std::exception& error) {  // OpenSSL has no memory or random numbers
    end(error.what());
  }
}

DatagramSession::Time DatagramSession::dueTime() const {
  if (!association_) return offerAt_;
  const std::uint64_t us = cs_datagrams_due_at(link_.get());
  const Time due = us == UINT64_MAX ? Time::max() : Time(std::chrono::microseconds(us));
  return std::min(due, association_->nextTime());
}

bool DatagramSession::holds(std::span<const std::byte> message) {
  return association_ && cs_hold_message(link_.get(), dataOf(message), message.size(), nowUs()) != 0;
}

bool DatagramSession::sends(std::span<const std::byte> message) {
  return association_ && cs_send_in_datagram(link_.get(), dataOf(message), message.size(), nowUs()) != 0;
}

std::optional<std::span<const std::byte>> DatagramSession::nextMessage() {
  if (!association_) return std::nullopt;
  std::size_t bytes = 0;
  const std::uint8_t* message = cs_next_datagram_message(link_.get(), nowUs(), &bytes);
  return viewOf(message, bytes);
}

std::optional<std::span<const std::byte>> DatagramSession::nextStreamMessage() {
  if (!association_) return std::nullopt;
  std::size_t bytes = 0;
  const std::uint8_t* message = cs_next_stream_message(link_.get(), nowUs(), &bytes);
  return viewOf(message, bytes);
}

void DatagramSession::end(std::string why) {
  why_ = std::move(why);
  earlier_ = statistics();
  earlier_.in_use = 0;
  association_.reset();
  link_.reset();
  offerAt_ = SteadyClock::now() + kOfferAgain;
}

cs_datagram_statistics DatagramSession::statistics() const {
  cs_datagram_statistics sum{};
  if (link_) cs_get_datagram_statistics(link_.get(), nowUs(), &sum);
  add(sum, earlier_);
  return sum;
}

}  // namespace clothstream
