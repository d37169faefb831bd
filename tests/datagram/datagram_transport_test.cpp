// SPDX-License-Identifier: MIT
// A transport with datagrams, against a server's side of ICE and DTLS on a socket of this machine.
#include "clients/datagram/datagram_transport.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/datagram/udp_socket.h"
#include "clients/native/native_client.h"
#include "clothstream/v1/session.pb.h"
#include "proto/datagram/frame_pieces.h"
#include "proto/datagram/input_bundle.h"
#include "proto/dtls/digest.h"
#include "proto/dtls/dtls_channel.h"
#include "proto/ice/lite_agent.h"
#include "tests/core/scripted_server.h"

namespace clothstream {
namespace {

using client::ScriptedServer;
using ::testing::HasSubstr;
using SteadyClock = std::chrono::steady_clock;

// Server's side of the datagrams: one association.
class Peer {
 public:
  enum class Mode { opens, refuses, hasAnotherKey };
  explicit Peer(Mode mode = Mode::opens) : mode_(mode) {}

  v1::DatagramAnswer answer(const v1::DatagramOffer& offer) {
    v1::DatagramAnswer answer;
    if (mode_ == Mode::refuses) return answer;
    dtls::Digest digest{};
    std::ranges::copy(offer.fingerprint(), reinterpret_cast<char*>(digest.data()));
    fingerprint_ = dtls::fingerprintOf(digest);
    const ice::Credentials local = ice::randomCredentials();
    agent_.emplace(local, ice::Credentials{offer.ufrag(), offer.password()}, SteadyClock::now());
    channel_.reset();
    answer.set_ufrag(local.ufrag);
    answer.set_password(local.password);
    const auto own = dtls::digestOf(mode_ == Mode::opens ? certificate_.fingerprint() : fingerprint_);
    answer.set_fingerprint(own.data(), own.size());
    answer.add_addresses(address);
    answer.set_port(socket_.port());
    return answer;
  }

  // Handles what has arrived.
  void step() {
    const auto now = SteadyClock::now();
    for (const ReceivedDatagram& datagram : socket_.take()) {
      if (!agent_) continue;
      if (ice::isStun(datagram.bytes))
        send(agent_->handle(datagram.from, datagram.bytes, now));
      else if (agent_->selected(now) == datagram.from)
        channel().handle(datagram.bytes, now);
    }
    if (agent_) send(agent_->advance(now));
    if (channel_) channel_->advance(now);
  }
  bool isOpen() const { return channel_ && channel_->state() == dtls::DtlsChannel::State::open; }
  bool hasClosed() const { return channel_ && channel_->state() == dtls::DtlsChannel::State::closed; }

  void sendFrame(const std::string& message) {
    const auto bytes = std::as_bytes(std::span(message));
    const datagram::FramePieces frame(
        std::make_shared<const std::vector<std::byte>>(bytes.begin(), bytes.end()), 0);
    std::array<std::byte, datagram::kMaxDatagramBytes> out;
    for (unsigned i = 0; i < frame.dataPieces(); ++i)
      channel().send(std::span(out).first(frame.write({packet_++, 0, frame_}, i, out)));
    ++frame_;
  }
  std::string address = "127.0.0.1";  // in answers
  // Messages of the client in datagrams.
  std::vector<v1::ClientMessage> input;

 private:
  dtls::DtlsChannel& channel() {
    if (!channel_)
      channel_.emplace(context_, dtls::Role::server, fingerprint_,
                       dtls::DtlsChannel::Callbacks{
                           .send =
                               [this](std::span<const std::byte> datagram) {
                                 if (const auto to = agent_->selected(SteadyClock::now()))
                                   socket_.send(*to, datagram);
                               },
                           .receive = [this](std::span<const std::byte> payload) { received(payload); }},
                       SteadyClock::now());
    return *channel_;
  }
  void send(const std::vector<ice::Datagram>& datagrams) {
    for (const ice::Datagram& datagram : datagrams) socket_.send(datagram.to, datagram.bytes);
  }
  void received(std::span<const std::byte> payload) {
    if (const auto messages = receiver_.receive(payload))
      for (const auto message : *messages)
        input.emplace_back().ParseFromArray(message.data(), static_cast<int>(message.size()));
  }

  const Mode mode_;
  const dtls::Certificate certificate_;
  const dtls::DtlsContext context_{certificate_};
  std::string fingerprint_;
  std::optional<ice::LiteAgent> agent_;
  std::optional<dtls::DtlsChannel> channel_;
  datagram::InputReceiver receiver_;
  std::uint32_t packet_ = 0, frame_ = 0;
  UdpThread thread_;
  UdpSocket socket_{thread_, [] {}};
};

// A stream without a network. The messages that the client writes go to `server`, which may answer.
class Stream final : public Transport {
 public:
  using Server = std::function<void(Stream&, const v1::ClientMessage&)>;
  // `idle` is called in each wait().
  Stream(Server server, std::function<void()> idle) : server_(std::move(server)), idle_(std::move(idle)) {}

  std::string address;  // of serverAddress()

  std::string serverAddress() const override { return address; }
  void say(std::string message) { incoming_.push_back(std::move(message)); }

  void connect(const std::string&) override { active_ = true; }
  void prepare(const std::string&) override {}
  bool active() const override { return active_; }
  bool hasOpened() const override { return active_; }
  bool canWrite() const override { return active_; }
  void write(std::span<const std::byte> bytes) override {
    v1::ClientMessage message;
    message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
    server_(*this, message);
  }
  void leave() override { active_ = false; }
  void cancel() override { active_ = false; }
  void wait(SteadyClock::duration atMost) override {
    idle_();
    std::unique_lock lock(mutex_);
    const auto time = incoming_.empty()
                          ? std::min<SteadyClock::duration>(atMost, std::chrono::milliseconds(1))
                          : SteadyClock::duration::zero();
    changed_.wait_for(lock, time, [&] { return woken_; });
    woken_ = false;
  }
  std::optional<std::span<const std::byte>> receive() override {
    if (incoming_.empty()) return std::nullopt;
    message_ = std::move(incoming_.front());
    incoming_.pop_front();
    return std::as_bytes(std::span(message_));
  }
  void wake() override {
    const std::lock_guard lock(mutex_);
    woken_ = true;
    changed_.notify_all();
  }
  bool endedByServer() const override { return true; }
  Failure notJoined() const override { return {Failure::Kind::lost, "ended"}; }
  Failure lost() const override { return {Failure::Kind::lost, "ended"}; }

 private:
  const Server server_;
  const std::function<void()> idle_;
  std::deque<std::string> incoming_;
  std::string message_;
  bool active_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool woken_ = false;
};

// A server with a stream and datagrams, and a client that joins it.
class DatagramTransportTest : public ::testing::Test {
 protected:
  tl::expected<std::unique_ptr<NativeClient>, Failure> join(Datagrams use,
                                                            std::chrono::milliseconds timeout) {
    auto stream = std::make_unique<Stream>(
        [this](Stream& to, const v1::ClientMessage& message) { handle(to, message); },
        [this] {
          peer->step();
          // Frames follow once the datagrams are open.
          for (; peer->isOpen() && tick_ < 20; ++tick_)
            peer->sendFrame(
                server_.frame(tick_, tick_ == 1 ? codec::PacketKind::key : codec::PacketKind::predicted));
        });
    stream->address = streamAddress;
    NativeClientOptions options;
    options.joinTimeout = timeout;
    options.reconnectFor = std::chrono::milliseconds(0);
    return NativeClient::join("127.0.0.1:1", withDatagrams(std::move(stream), use), options,
                              [](cs_client*, std::uint32_t) {});
  }
  static std::uint64_t framesOf(NativeClient& client) {
    cs_statistics statistics;
    client.visit([&](cs_client* core) { cs_get_statistics(core, NativeClient::nowUs(), &statistics); });
    return statistics.frames;
  }
  template <typename Done>
  static bool waitUntil(Done done) {
    const auto end = SteadyClock::now() + std::chrono::seconds(20);
    while (!done() && SteadyClock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return done();
  }

  std::shared_ptr<Peer> peer = std::make_shared<Peer>();
  std::string streamAddress;
  std::atomic<int> acknowledgedByStream = 0, posesByStream = 0;

 private:
  // On the thread of the client, as idle.
  void handle(Stream& to, const v1::ClientMessage& message) {
    if (message.has_hello()) {
      to.say(server_.welcome());
      for (const std::string& chunk : server_.chunks()) to.say(chunk);
    }
    if (message.has_datagram_offer()) {
      v1::ServerMessage answer;
      *answer.mutable_datagram_answer() = peer->answer(message.datagram_offer());
      to.say(answer.SerializeAsString());
    }
    if (message.has_ping())
      to.say(ScriptedServer::pong(message.ping().client_time_us(), message.ping().client_time_us()));
    acknowledgedByStream += message.has_frame_ack() ? 1 : 0;
    posesByStream += message.has_collider_poses() ? 1 : 0;
  }

  ScriptedServer server_;
  std::uint64_t tick_ = 1;
};

TEST_F(DatagramTransportTest, FramesArriveAndInputLeaves) {
  auto joined = join(Datagrams::required, std::chrono::seconds(20));
  ASSERT_TRUE(joined) << joined.error().text;
  NativeClient& client = **joined;
  ASSERT_TRUE(waitUntil([&] { return framesOf(client) == 19; }));
  EXPECT_EQ(acknowledgedByStream, 0);
  client.visit([&](cs_client* core) {
    const cs_own_collider sphere = client::sphereAt(1, 2, 3, 0.1f);
    cs_set_colliders(core, &sphere, 1, NativeClient::nowUs());
  });
  ASSERT_TRUE(waitUntil([&] { return posesByStream == 1; })) << "the last poses settle on the stream";
  const auto figures = client.datagrams();
  ASSERT_TRUE(figures);
  EXPECT_EQ(figures->frames, 19u);
  EXPECT_EQ(figures->lost_packets, 0u);
  joined->reset();
  bool hasAcknowledged = false, hasPoses = false;
  for (int i = 0; i < 100 && !peer->hasClosed(); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
    peer->step();
  }
  for (const v1::ClientMessage& message : peer->input) {
    hasAcknowledged |= message.has_frame_ack();
    hasPoses |= message.has_collider_poses();
  }
  EXPECT_TRUE(hasAcknowledged && hasPoses);
  EXPECT_TRUE(peer->hasClosed()) << "the client says goodbye";
}

TEST_F(DatagramTransportTest, RefusalLeavesTheStream) {
  peer = std::make_shared<Peer>(Peer::Mode::refuses);
  auto joined = join(Datagrams::automatic, std::chrono::seconds(20));
  ASSERT_TRUE(joined) << joined.error().text;
  EXPECT_FALSE((*joined)->datagrams());
}

TEST_F(DatagramTransportTest, RequirementFailsAtRefusal) {
  peer = std::make_shared<Peer>(Peer::Mode::refuses);
  const auto joined = join(Datagrams::required, std::chrono::seconds(20));
  ASSERT_FALSE(joined);
  EXPECT_EQ(joined.error().kind, Failure::Kind::refused);
  EXPECT_THAT(joined.error().text, HasSubstr("the server opens none"));
}

TEST_F(DatagramTransportTest, RequirementFailsWithAnotherKey) {
  peer = std::make_shared<Peer>(Peer::Mode::hasAnotherKey);
  const auto joined = join(Datagrams::required, std::chrono::milliseconds(500));
  ASSERT_FALSE(joined);
  EXPECT_EQ(joined.error().kind, Failure::Kind::unreachable);
  EXPECT_THAT(joined.error().text, HasSubstr("DTLS"));
}

TEST_F(DatagramTransportTest, TriesTheAddressOfTheStream) {
  peer->address = "192.0.2.1";  // of no machine (RFC 5737)
  streamAddress = "127.0.0.1";
  const auto joined = join(Datagrams::required, std::chrono::seconds(20));
  EXPECT_TRUE(joined) << joined.error().text;
}

TEST_F(DatagramTransportTest, OffMeansNoOffer) {
  const auto joined = join(Datagrams::off, std::chrono::seconds(20));
  ASSERT_TRUE(joined) << joined.error().text;
  EXPECT_FALSE(peer->isOpen());
}

TEST(UdpSockets, ExchangeDatagrams) {
  UdpThread thread;
  std::atomic<int> arrivals = 0;
  UdpSocket first(thread, [&] { ++arrivals; }), second(thread, [] {});
  const std::vector<std::byte> datagram(100, std::byte{7});
  const auto loopback = readAddress("127.0.0.1", first.port());
  ASSERT_TRUE(loopback);
  second.send(*loopback, datagram);
  const auto end = SteadyClock::now() + std::chrono::seconds(20);
  while (arrivals == 0 && SteadyClock::now() < end) std::this_thread::yield();
  const std::vector<ReceivedDatagram> arrived = first.take();
  ASSERT_EQ(arrived.size(), 1u);
  EXPECT_EQ(arrived[0].bytes, datagram);
  EXPECT_EQ(arrived[0].from, *readAddress("127.0.0.1", second.port()));
  EXPECT_FALSE(readAddress("localhost", 1));
  EXPECT_FALSE(readAddress("1.2.3.4.5", 1));
}

}  // namespace
}  // namespace clothstream
