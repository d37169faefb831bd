// SPDX-License-Identifier: MIT
#include "tests/endpoint/datagram/datagram_client.h"

#include <array>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"
#include "proto/datagram/piece.h"
#include "proto/datagram/piece_request.h"
#include "proto/tls/fingerprint.h"
#include "server/schedule/clock.h"

namespace clothstream::tests {
namespace {

using schedule::Clock;

const dtls::Certificate& certificate() {
  static const dtls::Certificate made;
  return made;
}
const dtls::DtlsContext& context() {
  static const dtls::DtlsContext made(certificate());
  return made;
}

// SHA-256 of the client's certificate.
std::string digest() {
  const std::string& text = certificate().fingerprint();
  std::string bytes;
  for (std::size_t at = text.find(' ') + 1; at + 2 <= text.size(); at += 3)
    bytes += static_cast<char>(std::stoi(text.substr(at, 2), nullptr, 16));
  return bytes;
}

std::string sdpOf(const std::string& bytes) {
  KeyDigest digest{};
  std::memcpy(digest.data(), bytes.data(), digest.size());
  return "sha-256 " + fingerprintText(digest);
}

std::uint64_t nowUs() {
  return schedule::microseconds(Clock::now());
}

}  // namespace

DatagramClient::DatagramClient(hosting::SceneServer& server, const std::string& scene)
    : session_(session::Session::open(
          server, {.peer = "client", .address = {}, .token = {}, .reached = "127.0.0.1"}, [] {})) {
  socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket_ < 0) throw std::runtime_error("no UDP socket");
  v1::ClientMessage message;
  message.mutable_hello()->set_protocol_version(1);
  message.mutable_hello()->set_scene(scene);
  for (const std::uint32_t codec : codec::kCodecs) message.mutable_hello()->add_codecs(codec);
  send(message);
}

DatagramClient::~DatagramClient() {
  session_.reset();
  ::close(socket_);
}

void DatagramClient::offer(bool sctp, const std::string& fingerprint) {
  answer.reset();
  connected_ = false;
  channel_.reset();
  dtls_.reset();
  agent_.reset();
  assembly_ = datagram::FrameAssembly();
  received_ = datagram::ReceivedPackets();
  input_ = datagram::InputSender();
  sctp_ = sctp;
  local_ = ice::randomCredentials();
  v1::ClientMessage message;
  v1::DatagramOffer& offer = *message.mutable_datagram_offer();
  offer.set_ufrag(local_.ufrag);
  offer.set_password(local_.password);
  offer.set_fingerprint(fingerprint.empty() ? digest() : fingerprint);
  offer.set_sctp(sctp);
  send(message);
}

void DatagramClient::send(const v1::ClientMessage& message) {
  const std::string bytes = message.SerializeAsString();
  if (session_) session_->receive(std::as_bytes(std::span(bytes)));
}

void DatagramClient::sendDatagram(const v1::ClientMessage& message) {
  const std::string bytes = message.SerializeAsString();
  std::array<std::byte, datagram::kMaxDatagramBytes> out;
  const std::size_t size = input_.write(std::as_bytes(std::span(bytes)), nowUs(), out);
  sendPayload(std::span(out).first(size));
}

bool DatagramClient::isOpen() const {
  return dtls_ && dtls_->state() == dtls::DtlsChannel::State::open && (!channel_ || channel_->isOpen());
}

void DatagramClient::poll() {
  readStream();
  if (!answer || answer->addresses().empty()) return;
  const Clock::time_point now = Clock::now();
  if (!agent_) {
    std::array<std::uint8_t, 4> address{};
    ::inet_pton(AF_INET, answer->addresses(0).c_str(), address.data());
    const std::array candidates{ice::Address::ofIpv4(address, static_cast<std::uint16_t>(answer->port()))};
    agent_.emplace(
        local_,
        ice::Credentials{.ufrag = answer->ufrag(), .password = wrongPassword.value_or(answer->password())},
        candidates, now);
  }
  readSocket();
  for (const ice::Datagram& check : agent_->advance(now)) transmit(check);
  if (!dtls_ && agent_->selected(now)) connect();
  if (dtls_) dtls_->advance(now);
  if (channel_ && dtls_->state() == dtls::DtlsChannel::State::open) {
    if (!std::exchange(connected_, true)) channel_->connect(now);
    channel_->advance(now);
  }
  std::array<std::byte, datagram::kMaxDatagramBytes> out;
  if (input_.repeatUs().value_or(~0ull) <= nowUs()) {
    const std::size_t size = input_.repeat(nowUs(), out);
    sendPayload(std::span(out).first(size));
  }
  while (const auto frame = assembly_.next(nowUs())) {
    datagramFrames.emplace_back(frame->message.begin(), frame->message.end());
    acknowledge(frame->message);
  }
  while (const auto request = assembly_.nextRequest(nowUs()))
    sendPayload(std::span(out).first(datagram::writeRequest(*request, out)));
  if (received_.dueUs().value_or(~0ull) <= nowUs())
    if (const auto receipt = received_.take())
      sendPayload(std::span(out).first(datagram::writeReceipt(*receipt, out)));
}

void DatagramClient::readStream() {
  while (session_) {
    const auto bytes = session_->next();
    if (!bytes) return;
    v1::ServerMessage message;
    if (!message.ParseFromArray((*bytes)->data(), static_cast<int>((*bytes)->size())))
      throw std::runtime_error("the bytes are not a ServerMessage");
    if (message.has_frame()) {
      streamFrames.emplace_back((*bytes)->begin(), (*bytes)->end());
      acknowledge(**bytes);
      continue;
    }
    if (message.has_datagram_answer()) answer = message.datagram_answer();
    messages.push_back(std::move(message));
  }
}

void DatagramClient::acknowledge(std::span<const std::byte> frame) {
  v1::ServerMessage message;
  if (!message.ParseFromArray(frame.data(), static_cast<int>(frame.size())) || !message.has_frame())
    throw std::runtime_error("the bytes are not a frame");
  // Packets of some tests are no packets; those have their tick as their time.
  const auto packet = codec::parsePacket(std::as_bytes(std::span(message.frame().packet())));
  v1::ClientMessage ack;
  ack.mutable_frame_ack()->set_tick(packet ? packet->header.tick : message.frame().tick_time_us());
  send(ack);
}

void DatagramClient::readSocket() {
  std::array<std::byte, 2048> datagram;
  sockaddr_in from{};
  socklen_t size = sizeof from;
  for (;;) {
    const ssize_t bytes =
        ::recvfrom(socket_, datagram.data(), datagram.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (bytes <= 0) return;
    const std::span received = std::span(datagram).first(static_cast<std::size_t>(bytes));
    std::array<std::uint8_t, 4> address{};
    std::memcpy(address.data(), &from.sin_addr, address.size());
    if (ice::isStun(received)) {
      for (const ice::Datagram& reply :
           agent_->handle(ice::Address::ofIpv4(address, ntohs(from.sin_port)), received, Clock::now()))
        transmit(reply);
    } else if (dtls_) {
      dtls_->handle(received, Clock::now());
    }
  }
}

void DatagramClient::connect() {
  if (sctp_)
    channel_ = std::make_unique<sctp::DataChannel>(
        sctp::DataChannel::Options{.label = "clothstream", .association = {.tag = 7, .firstTsn = 1}},
        [this](std::span<const std::byte> packet) { dtls_->send(packet); },
        [this](std::span<const std::byte> payload) { receive(payload); });
  dtls_ = std::make_unique<dtls::DtlsChannel>(
      context(), dtls::Role::client, sdpOf(answer->fingerprint()),
      dtls::DtlsChannel::Callbacks{.send =
                                       [this](std::span<const std::byte> datagram) {
                                         if (const auto to = agent_->selected(Clock::now()))
                                           transmit({.to = *to, .bytes = {datagram.begin(), datagram.end()}});
                                       },
                                   .receive =
                                       [this](std::span<const std::byte> payload) {
                                         if (channel_)
                                           channel_->receive(Clock::now(), payload);
                                         else
                                           receive(payload);
                                       }},
      Clock::now());
}

void DatagramClient::receive(std::span<const std::byte> payload) {
  const auto piece = datagram::parsePiece(payload);
  if (!piece) throw std::runtime_error("a payload is no piece");
  received_.add(piece->prefix.packet, nowUs());
  assembly_.add(*piece, nowUs());
}

void DatagramClient::sendPayload(std::span<const std::byte> payload) {
  if (channel_)
    static_cast<void>(channel_->send(Clock::now(), payload, false));
  else if (dtls_)
    dtls_->send(payload);
}

void DatagramClient::transmit(const ice::Datagram& datagram) const {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(datagram.to.port);
  std::memcpy(&to.sin_addr, datagram.to.bytes.data() + 12, sizeof to.sin_addr);
  static_cast<void>(::sendto(socket_, datagram.bytes.data(), datagram.bytes.size(), 0,
                             reinterpret_cast<const sockaddr*>(&to), sizeof to));
}

}  // namespace clothstream::tests
