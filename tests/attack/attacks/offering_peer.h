// SPDX-License-Identifier: MIT
// A participant with datagrams, for attacks on them.
#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <grpcpp/client_context.h>

#include "clients/datagram/association.h"
#include "proto/datagram/input_bundle.h"
#include "proto/dtls/certificate.h"
#include "proto/dtls/dtls_context.h"
#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {

// A UDP socket of 127.0.0.1 that counts payload bytes. Belongs to one thread.
class UdpSource {
 public:
  UdpSource();  // throws std::runtime_error
  ~UdpSource();
  UdpSource(const UdpSource&) = delete;
  UdpSource& operator=(const UdpSource&) = delete;

  // `to` is an IPv4 address. The datagram is lost if the kernel has no room.
  void send(const ice::Address& to, std::span<const std::byte> datagram);
  // Returns what has arrived, or arrives within this time. Valid until the next call.
  std::optional<std::span<const std::byte>> receive(std::chrono::milliseconds time = {});

  std::uint64_t sentBytes() const { return sentBytes_; }
  std::uint64_t receivedBytes() const { return receivedBytes_; }
  // Datagrams received that are not STUN messages.
  std::uint64_t receivedRecords() const { return receivedRecords_; }

 private:
  const int file_;
  std::vector<std::byte> buffer_;
  std::uint64_t sentBytes_ = 0, receivedBytes_ = 0, receivedRecords_ = 0;
};

// Joins a scene by gRPC, acknowledges a frame, so that frames may leave in datagrams, and offers these.
// Belongs to one thread.
class OfferingPeer {
 public:
  // Throws std::runtime_error if it cannot join.
  explicit OfferingPeer(const Target& target, const std::string& scene = {});
  ~OfferingPeer();
  OfferingPeer(const OfferingPeer&) = delete;
  OfferingPeer& operator=(const OfferingPeer&) = delete;

  enum class Answer : std::uint8_t { accepted, refused, ended };
  // Offers, and waits for the answer. The functions below need one that is accepted.
  Answer offer();

  const ice::Address& server() const { return server_.addresses.front(); }
  // A check of this peer that the server must accept.
  std::vector<std::byte> check(bool nominates) const;
  // A check with its user name, but another password.
  std::vector<std::byte> wrongCheck() const;

  // Begins an association at the socket, which must outlive this peer or its next offer. Nothing arrives and
  // leaves without step().
  void begin(UdpSource& source);
  // Handles what has arrived, or arrives within this time. `handshakes`: records are handled, too.
  void step(std::chrono::milliseconds time = {}, bool handshakes = true);
  // Steps until the handshake is complete. Returns false if it is not within `patience`.
  bool open(std::chrono::seconds patience);
  // Sends a payload, or loses it.
  void send(std::span<const std::byte> payload);
  // Sends a message as input.
  void sendInput(const v1::ClientMessage& message);
  // Newest packet with a piece; nothing before the first one.
  std::optional<std::uint32_t> newestPacket() const { return newestPacket_; }
  // Answers to checks of this peer that have arrived.
  std::uint64_t answers() const { return answers_; }

  // Reads the stream from now on, without which gRPC answers no pings and the server ends the connection. No
  // offer may follow.
  void readOn();
  // Why the stream has ended; nothing while it is open. For a peer that reads on.
  std::optional<std::string> end();

 private:
  // Reads the stream until `stop` accepts a message. Returns false at its end.
  template <typename Stop>
  bool readUntil(Stop stop);
  void payloadArrived(std::span<const std::byte> payload);

  const std::unique_ptr<Stub> stub_;
  const dtls::Certificate certificate_;
  const dtls::DtlsContext context_{certificate_};
  grpc::ClientContext call_;
  const std::unique_ptr<grpc::ClientReaderWriter<v1::ClientMessage, v1::ServerMessage>> stream_;
  ice::Credentials local_;
  DatagramPeer server_;
  UdpSource* source_ = nullptr;
  std::optional<Association> association_;
  datagram::InputSender input_;
  std::optional<std::uint32_t> newestPacket_;
  std::uint64_t answers_ = 0;
  std::string error_;  // the newest one; belongs to reader_ until it has ended
  std::atomic<bool> ended_{false};
  std::jthread reader_;
};

}  // namespace clothstream::attack
