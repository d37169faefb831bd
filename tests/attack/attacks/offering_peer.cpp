// SPDX-License-Identifier: MIT
#include "tests/attack/attacks/offering_peer.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "clients/datagram/udp_socket.h"
#include "proto/codec/packet_header.h"
#include "proto/datagram/piece.h"
#include "proto/dtls/digest.h"
#include "proto/dtls/limits.h"
#include "proto/ice/stun_message.h"

namespace clothstream::attack {
namespace {

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

// Room for datagrams that arrive while the attacker is busy.
constexpr int kQueueBytes = 1 << 20;

}  // namespace

UdpSource::UdpSource()
    : file_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)),
      buffer_(dtls::kMaxDatagramBytes) {
  const sockaddr_in own = loopback(0);
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): the system's interface
  if (file_ >= 0 && ::bind(file_, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0) {
    ::setsockopt(file_, SOL_SOCKET, SO_RCVBUF, &kQueueBytes, sizeof kQueueBytes);
    return;
  }
  if (file_ >= 0) ::close(file_);
  throw std::runtime_error("no UDP socket");
}

UdpSource::~UdpSource() {
  ::close(file_);
}

void UdpSource::send(const ice::Address& to, std::span<const std::byte> datagram) {
  sockaddr_in address = loopback(to.port);
  std::memcpy(&address.sin_addr, to.bytes.data() + to.bytes.size() - sizeof address.sin_addr,
              sizeof address.sin_addr);
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): the system's interface
  const auto* const name = reinterpret_cast<const sockaddr*>(&address);
  if (::sendto(file_, datagram.data(), datagram.size(), 0, name, sizeof address) > 0)
    sentBytes_ += datagram.size();
}

std::optional<std::span<const std::byte>> UdpSource::receive(std::chrono::milliseconds time) {
  pollfd waits{file_, POLLIN, 0};
  if (time.count() > 0) static_cast<void>(::poll(&waits, 1, static_cast<int>(time.count())));
  const ssize_t size = ::recv(file_, buffer_.data(), buffer_.size(), 0);
  if (size < 0) return std::nullopt;
  const auto datagram = std::span<const std::byte>(buffer_).first(static_cast<std::size_t>(size));
  receivedBytes_ += datagram.size();
  if (!ice::isStun(datagram)) ++receivedRecords_;
  return datagram;
}

OfferingPeer::OfferingPeer(const Target& target, const std::string& scene)
    : stub_(stubOf(target)), stream_(stub_->Join(&call_)) {
  std::uint64_t tick = 0;
  const auto isFrame = [&](const v1::ServerMessage& message) {
    if (!message.has_frame()) return false;
    const auto packet = codec::parsePacket(std::as_bytes(std::span(message.frame().packet())));
    if (packet) tick = packet->header.tick;
    return packet.has_value();
  };
  if (!stream_->Write(helloTo(scene)) || !readUntil(isFrame))
    throw std::runtime_error("the attacker cannot join");
  v1::ClientMessage acknowledgement;
  acknowledgement.mutable_frame_ack()->set_tick(tick);
  stream_->Write(acknowledgement);
}

OfferingPeer::~OfferingPeer() {
  call_.TryCancel();
}

template <typename Stop>
bool OfferingPeer::readUntil(Stop stop) {
  v1::ServerMessage message;
  while (stream_->Read(&message))
    if (stop(std::as_const(message))) return true;
  return false;
}

OfferingPeer::Answer OfferingPeer::offer() {
  association_.reset();
  local_ = ice::randomCredentials();
  const dtls::Digest digest = dtls::digestOf(certificate_.fingerprint());
  v1::ClientMessage message;
  v1::DatagramOffer& offer = *message.mutable_datagram_offer();
  offer.set_ufrag(local_.ufrag);
  offer.set_password(local_.password);
  offer.set_fingerprint(digest.data(), digest.size());
  v1::DatagramAnswer answer;
  bool refused = false;
  const auto isAnswer = [&](const v1::ServerMessage& arrived) {
    refused = arrived.has_error();
    if (arrived.has_datagram_answer()) answer = arrived.datagram_answer();
    return refused || arrived.has_datagram_answer();
  };
  if (!stream_->Write(message) || !readUntil(isAnswer)) return Answer::ended;
  dtls::Digest theirs{};
  if (refused || answer.fingerprint().size() != theirs.size()) return Answer::refused;
  std::memcpy(theirs.data(), answer.fingerprint().data(), theirs.size());
  server_ = {.credentials = {answer.ufrag(), answer.password()},
             .fingerprint = dtls::fingerprintOf(theirs),
             .addresses = {}};
  for (const std::string& text : answer.addresses())
    if (const auto address = readAddress(text, static_cast<std::uint16_t>(answer.port())))
      server_.addresses.push_back(*address);
  return server_.addresses.empty() ? Answer::refused : Answer::accepted;
}

std::vector<std::byte> OfferingPeer::check(bool nominates) const {
  const ice::Pairing pairing(local_, server_.credentials, ice::Role::controlling);
  return pairing.check(ice::newTransaction(), nominates);
}

std::vector<std::byte> OfferingPeer::wrongCheck() const {
  const ice::Credentials wrong{server_.credentials.ufrag, ice::randomCredentials().password};
  const ice::Pairing pairing(local_, wrong, ice::Role::controlling);
  return pairing.check(ice::newTransaction(), true);
}

void OfferingPeer::begin(UdpSource& source) {
  source_ = &source;
  association_.emplace(
      context_, local_, server_,
      Association::Callbacks{
          .send = [this](const ice::Address& to,
                         std::span<const std::byte> datagram) { source_->send(to, datagram); },
          .receive = [this](std::span<const std::byte> payload) { payloadArrived(payload); }},
      Clock::now());
}

void OfferingPeer::step(std::chrono::milliseconds time, bool handshakes) {
  while (const auto datagram = source_->receive(time)) {
    time = {};
    const bool isStun = ice::isStun(*datagram);
    const auto message = isStun ? ice::readStun(*datagram) : std::nullopt;
    if (message && message->kind == ice::StunKind::success) ++answers_;
    if (isStun || handshakes) association_->handle(server(), *datagram, Clock::now());
  }
  association_->advance(Clock::now());
}

bool OfferingPeer::open(std::chrono::seconds patience) {
  for (const auto end = Clock::now() + patience; !association_->hasOpened() && Clock::now() < end;)
    step(std::chrono::milliseconds(5));
  return association_->hasOpened();
}

void OfferingPeer::send(std::span<const std::byte> payload) {
  association_->send(payload, Clock::now());
}

void OfferingPeer::sendInput(const v1::ClientMessage& message) {
  const std::string bytes = message.SerializeAsString();
  std::array<std::byte, datagram::kMaxDatagramBytes> payload;
  send(std::span(payload).first(input_.write(std::as_bytes(std::span(bytes)), 0, payload)));
}

void OfferingPeer::payloadArrived(std::span<const std::byte> payload) {
  if (const auto piece = datagram::parsePiece(payload)) newestPacket_ = piece->prefix.packet;
}

void OfferingPeer::readOn() {
  reader_ = std::jthread([this] {
    readUntil([this](const v1::ServerMessage& message) {
      if (message.has_error()) error_ = message.error().text();
      return false;
    });
    ended_ = true;
  });
}

std::optional<std::string> OfferingPeer::end() {
  if (!ended_) return std::nullopt;
  if (reader_.joinable()) reader_.join();
  return brief(error_);
}

}  // namespace clothstream::attack
