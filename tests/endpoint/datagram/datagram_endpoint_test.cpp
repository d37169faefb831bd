// SPDX-License-Identifier: MIT
// Datagrams over the loopback interface: how they open, what they carry, and how they end.
#include "server/endpoint/datagram/datagram_endpoint.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "proto/codec/stream_layout.h"
#include "server/hosting/scene_server.h"
#include "server/scene/frame_source.h"
#include "tests/endpoint/datagram/datagram_client.h"

namespace clothstream::tests {
namespace {

using schedule::Clock;
using namespace std::chrono_literals;

// A played scene whose frames the test publishes.
class PublishedSource final : public scene::FrameSource {
 public:
  explicit PublishedSource(bool lockstep) : lockstep_(lockstep) {
    description_.set_scene("played");
    description_.set_codec(codec::kCodecHierarchical);
    description_.set_simulation_rate(72);
    description_.set_stream_rate(72);
    description_.set_max_error(0.001f);
    v1::ClothDescription& cloth = *description_.add_cloths();
    cloth.set_name("sheet");
    cloth.set_vertex_count(4);
    cloth.set_rows(2);
    cloth.set_columns(2);
    cloth.set_rest_positions(std::string(4 * 3 * sizeof(float), '\0'));
  }

  const v1::StreamDescription& description() const override { return description_; }
  std::string deviceName() const override { return "none"; }
  bool inLockstep() const override { return lockstep_; }
  void begin(scene::LiveScene& /*scene*/) override {}
  void end() override {}
  void wake() override {}
  messages::Result<void> control(const v1::ControlSceneRequest& /*request*/) override { return {}; }
  std::string whyFixed() const override { return "is a test"; }
  std::optional<v1::Playback> playback() const override { return v1::Playback(); }
  v1::ParameterChange parameters() const override { return {}; }

 private:
  const bool lockstep_;
  v1::StreamDescription description_;
};

class DatagramEndpointTest : public ::testing::Test {
 protected:
  explicit DatagramEndpointTest(bool lockstep = false)
      : server_("played", std::make_shared<PublishedSource>(lockstep), {}) {}

  // Lets the clients work until `holds` returns true.
  static bool until(std::initializer_list<DatagramClient*> clients, const std::function<bool()>& holds) {
    for (const auto end = Clock::now() + 20s; Clock::now() < end; std::this_thread::sleep_for(500us)) {
      for (DatagramClient* client : clients) client->poll();
      if (holds()) return true;
    }
    return false;
  }
  // Publishes a frame of about this length.
  std::vector<std::byte> publish(std::size_t bytes = 5000) {
    ++tick_;
    v1::Frame frame;
    frame.set_tick_time_us(tick_);
    std::vector<std::byte> packet(bytes);
    for (std::size_t i = 0; i < bytes; ++i) packet[i] = static_cast<std::byte>(i * tick_);
    const delivery::SharedBytes message = delivery::serialiseFrame(frame, packet);
    server_.scenes.all().front()->subscribers.publish(delivery::PublishedFrame{.message = message,
                                                                               .tick = tick_,
                                                                               .key = tick_ == 1,
                                                                               .referenceTick = tick_ - 1,
                                                                               .complete = Clock::now()});
    return *message;
  }
  // Joins, gets the first frame on the stream, and waits until datagrams are open.
  void open(DatagramClient& client, bool sctp = false) {
    client.offer(sctp);
    ASSERT_TRUE(until({&client}, [&] { return client.answer.has_value(); }));
    const auto first = publish();
    ASSERT_TRUE(until({&client}, [&] { return client.isOpen() && server_.metrics.datagrams.peers == 1; }));
    ASSERT_EQ(client.streamFrames.size(), 1u);
    EXPECT_EQ(client.streamFrames[0], first);
  }
  void framesArrive(bool sctp) {
    DatagramClient client(server_);
    open(client, sctp);
    std::vector<std::vector<std::byte>> frames;
    for (const std::size_t bytes : {100u, 5000u, 40'000u, 5000u}) {
      frames.push_back(publish(bytes));
      ASSERT_TRUE(until({&client}, [&] { return client.datagramFrames.size() == frames.size(); })) << bytes;
    }
    EXPECT_EQ(client.datagramFrames, frames);
    EXPECT_EQ(client.streamFrames.size(), 1u);

    v1::ClientMessage ping;
    ping.mutable_ping()->set_client_time_us(77);
    client.sendDatagram(ping);
    ping.mutable_ping()->set_client_time_us(78);
    client.sendDatagram(ping);
    const auto pongs = [&] {
      return std::ranges::count_if(client.messages, [](const auto& message) { return message.has_pong(); });
    };
    ASSERT_TRUE(until({&client}, [&] { return pongs() == 2; }));
    const auto end = Clock::now() + 60ms;  // the client repeats its datagram
    ASSERT_TRUE(until({&client}, [&] { return Clock::now() > end; }));
    EXPECT_EQ(pongs(), 2);
  }
  // Datagrams do not open within this time, and frames arrive on the stream.
  void staysOnStream(DatagramClient& client) {
    publish();
    ASSERT_TRUE(until({&client}, [&] { return client.streamFrames.size() == 1; }));
    publish();
    ASSERT_TRUE(until({&client}, [&] { return client.streamFrames.size() == 2; }));
    EXPECT_EQ(server_.metrics.datagrams.peers, 0u);
  }

  hosting::SceneServer server_;
  std::uint64_t tick_ = 0;
  endpoint::DatagramEndpoint endpoint_{server_, {.publicAddresses = {"192.0.2.1", "127.0.0.1"}}};
};

TEST_F(DatagramEndpointTest, CarriesFramesAndInput) {
  framesArrive(false);
}

TEST_F(DatagramEndpointTest, CarriesThemInDataChannel) {
  framesArrive(true);
}

TEST_F(DatagramEndpointTest, AnswersWithAddressesOfStreamFirst) {
  DatagramClient client(server_);
  client.offer();
  ASSERT_TRUE(until({&client}, [&] { return client.answer.has_value(); }));
  EXPECT_EQ(client.answer->port(), endpoint_.port());
  EXPECT_EQ(client.answer->fingerprint().size(), 32u);
  ASSERT_EQ(client.answer->addresses_size(), 2);
  EXPECT_EQ(client.answer->addresses(0), "127.0.0.1");
  EXPECT_EQ(client.answer->addresses(1), "192.0.2.1");
}

TEST_F(DatagramEndpointTest, LongFramesStayOnStream) {
  DatagramClient client(server_);
  open(client);
  const auto frame = publish(200'000);
  ASSERT_TRUE(until({&client}, [&] { return client.streamFrames.size() == 2; }));
  EXPECT_EQ(client.streamFrames.back(), frame);
}

TEST_F(DatagramEndpointTest, RefusesMalformedOffer) {
  DatagramClient client(server_);
  client.offer(false, "short");
  const auto refusal = [&] { return std::ranges::find_if(client.messages, &v1::ServerMessage::has_error); };
  ASSERT_TRUE(until({&client}, [&] { return refusal() != client.messages.end(); }));
  EXPECT_EQ(refusal()->error().code(), v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_NE(refusal()->error().text().find("datagram_offer.fingerprint"), std::string::npos);
  staysOnStream(client);
}

TEST_F(DatagramEndpointTest, WrongFingerprintStaysOnStream) {
  DatagramClient client(server_);
  client.offer(false, std::string(32, 'x'));
  ASSERT_TRUE(until({&client}, [&] {
    return client.dtls() != nullptr && client.dtls()->state() == dtls::DtlsChannel::State::failed;
  }));
  staysOnStream(client);
}

TEST_F(DatagramEndpointTest, WrongPasswordGetsNoAnswer) {
  DatagramClient client(server_);
  client.wrongPassword = "0123456789012345678901";
  client.offer();
  const auto end = Clock::now() + 150ms;
  ASSERT_TRUE(until({&client}, [&] { return Clock::now() > end; }));
  EXPECT_EQ(client.dtls(), nullptr);
  staysOnStream(client);
}

TEST_F(DatagramEndpointTest, NewOfferReplacesAssociation) {
  DatagramClient client(server_);
  open(client);
  client.offer();
  ASSERT_TRUE(until({&client}, [&] { return client.isOpen() && server_.metrics.datagrams.peers == 1; }));
  const auto before = client.datagramFrames.size();
  const auto frame = publish();
  ASSERT_TRUE(until({&client}, [&] { return client.datagramFrames.size() == before + 1; }));
  EXPECT_EQ(client.datagramFrames.back(), frame);
}

TEST_F(DatagramEndpointTest, AssociationEndsWithSession) {
  DatagramClient client(server_);
  open(client);
  client.leave();
  EXPECT_TRUE(until({&client}, [&] {
    return server_.metrics.datagrams.peers == 0 && client.dtls()->state() == dtls::DtlsChannel::State::closed;
  }));
}

class LockstepDatagramTest : public DatagramEndpointTest {
 protected:
  LockstepDatagramTest() : DatagramEndpointTest(true) {}
};

TEST_F(LockstepDatagramTest, OpensNone) {
  DatagramClient client(server_);
  client.offer();
  ASSERT_TRUE(until({&client}, [&] { return client.answer.has_value(); }));
  EXPECT_EQ(client.answer->addresses_size(), 0);
}

}  // namespace
}  // namespace clothstream::tests
