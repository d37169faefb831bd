// SPDX-License-Identifier: MIT
// A client of the datagram endpoint in the same process: a session, and a UDP socket with the client's side
// of ICE, DTLS and SCTP.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "proto/datagram/frame_assembly.h"
#include "proto/datagram/input_bundle.h"
#include "proto/datagram/receipt.h"
#include "proto/dtls/dtls_channel.h"
#include "proto/ice/checking_agent.h"
#include "proto/sctp/data_channel.h"
#include "server/hosting/scene_server.h"
#include "server/session/session.h"

namespace clothstream::tests {

// Belongs to one thread, which calls poll() again and again.
class DatagramClient {
 public:
  // Says hello. An empty name is that of the server's default scene.
  explicit DatagramClient(hosting::SceneServer& server, const std::string& scene = {});
  ~DatagramClient();
  DatagramClient(const DatagramClient&) = delete;
  DatagramClient& operator=(const DatagramClient&) = delete;

  // Offers datagrams. The fingerprint is that of the client's certificate, unless another one is given.
  void offer(bool sctp = false, const std::string& fingerprint = {});
  // The password that the client uses from now on for the server's end.
  std::optional<std::string> wrongPassword;

  // Reads and sends what is due.
  void poll();
  // Whether payloads can be sent.
  bool isOpen() const;
  void send(const v1::ClientMessage& message);          // on the stream
  void sendDatagram(const v1::ClientMessage& message);  // as input
  void leave() { session_.reset(); }

  std::optional<v1::DatagramAnswer> answer;
  std::vector<v1::ServerMessage> messages;  // of the stream, without frames
  std::vector<std::vector<std::byte>> streamFrames, datagramFrames;
  const dtls::DtlsChannel* dtls() const { return dtls_.get(); }

 private:
  void readStream();
  void readSocket();
  void connect();
  void receive(std::span<const std::byte> payload);
  void sendPayload(std::span<const std::byte> payload);
  void transmit(const ice::Datagram& datagram) const;
  void acknowledge(std::span<const std::byte> frame);

  int socket_ = -1;
  std::shared_ptr<session::Session> session_;
  ice::Credentials local_;
  bool sctp_ = false, connected_ = false;
  std::optional<ice::CheckingAgent> agent_;
  std::unique_ptr<dtls::DtlsChannel> dtls_;
  std::unique_ptr<sctp::DataChannel> channel_;
  datagram::FrameAssembly assembly_;
  datagram::ReceivedPackets received_;
  datagram::InputSender input_;
};

}  // namespace clothstream::tests
