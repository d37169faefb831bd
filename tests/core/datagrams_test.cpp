// SPDX-License-Identifier: MIT
// Offers of datagrams, frames on two ways, and input in datagrams.
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/core/datagrams/frame_order.h"
#include "proto/datagram/input_bundle.h"
#include "proto/datagram/receipt.h"
#include "proto/datagram/sent_frames.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr const char *kUfrag = "abcd", *kPassword = "0123456789abcdefghij+/";

cs_datagram_offer offer(const char* ufrag = kUfrag, const char* password = kPassword) {
  return {.version = CS_DATAGRAM_OFFER_VERSION,
          .ufrag = ufrag,
          .password = password,
          .fingerprint = {1, 2},
          .sctp = 1};
}

v1::DatagramAnswer answer() {
  v1::DatagramAnswer message;
  message.set_ufrag("efgh");
  message.set_password("ABCDEFGHIJKLMNOPQRSTUV");
  message.set_fingerprint(std::string(31, '\1') + '\2');
  message.add_addresses("192.0.2.1");
  message.add_addresses("2001:db8::1");
  message.set_port(4000);
  return message;
}

std::string serialised(const v1::DatagramAnswer& body) {
  v1::ServerMessage message;
  *message.mutable_datagram_answer() = body;
  return message.SerializeAsString();
}

TEST(DatagramOffers, FollowHelloOnce) {
  ClientUnderTest client;
  const cs_datagram_offer made = offer();
  ASSERT_EQ(cs_offer_datagrams(client.get(), &made), 1);
  const auto sent = client.outgoing();
  ASSERT_THAT(sent, SizeIs(2));
  EXPECT_TRUE(sent[0].has_hello());
  const v1::DatagramOffer& body = sent[1].datagram_offer();
  EXPECT_EQ(body.ufrag(), kUfrag);
  EXPECT_EQ(body.password(), kPassword);
  EXPECT_EQ(body.fingerprint(), std::string("\1\2", 2) + std::string(30, '\0'));
  EXPECT_TRUE(body.sctp());
  // An offer for a connection on which Hello is sent already.
  ASSERT_EQ(cs_offer_datagrams(client.get(), &made), 1);
  EXPECT_THAT(client.outgoing(), SizeIs(1));
  ASSERT_EQ(cs_offer_datagrams(client.get(), &made), 1);
  cs_connecting(client.get(), kMs);
  EXPECT_THAT(client.outgoing(), SizeIs(1)) << "offers are for one connection";
}

TEST(DatagramOffers, NeedAConnection) {
  ClientUnderTest client;
  const cs_datagram_offer made = offer();
  cs_disconnected(client.get(), kMs);
  EXPECT_EQ(cs_offer_datagrams(client.get(), &made), 0);
  cs_connecting(client.get(), 2 * kMs);
  EXPECT_EQ(cs_offer_datagrams(client.get(), &made), 1);
  const cs_client_options options = optionsFor("curtain");
  const std::unique_ptr<cs_client, decltype(&cs_destroy)> mirror(cs_create_mirror(&options), &cs_destroy);
  EXPECT_EQ(cs_offer_datagrams(mirror.get(), &made), 0);
}

TEST(DatagramOffers, RefuseWrongMembers) {
  ClientUnderTest client;
  client.outgoing();
  const std::string longUfrag(65, 'a'), longPassword(257, 'a');
  std::vector<cs_datagram_offer> wrong{offer("abc"),
                                       offer("ab-d"),
                                       offer(longUfrag.c_str()),
                                       offer(nullptr),
                                       offer(kUfrag, "short"),
                                       offer(kUfrag, longPassword.c_str()),
                                       offer(kUfrag, nullptr),
                                       offer(),
                                       offer()};
  wrong[7].version = 2;
  wrong[8].sctp = 2;
  for (const cs_datagram_offer& one : wrong) EXPECT_EQ(cs_offer_datagrams(client.get(), &one), 0);
  EXPECT_THAT(client.outgoing(), IsEmpty());
}

TEST(DatagramOffers, AnswersSayHowToReachServer) {
  ClientUnderTest client;
  cs_datagram_answer out;
  client.receive(serialised(answer()));
  EXPECT_EQ(cs_get_datagram_answer(client.get(), &out), 0) << "answer without an offer";
  const cs_datagram_offer made = offer();
  ASSERT_EQ(cs_offer_datagrams(client.get(), &made), 1);
  EXPECT_EQ(client.receive(serialised(answer())), std::uint32_t{CS_EVENT_DATAGRAMS});
  ASSERT_EQ(cs_get_datagram_answer(client.get(), &out), 1);
  EXPECT_STREQ(out.ufrag, "efgh");
  EXPECT_STREQ(out.password, "ABCDEFGHIJKLMNOPQRSTUV");
  EXPECT_EQ(out.fingerprint[31], 2);
  EXPECT_EQ(out.port, 4000u);
  ASSERT_EQ(out.addresses, 2u);
  EXPECT_STREQ(cs_datagram_address(client.get(), 0), "192.0.2.1");
  EXPECT_STREQ(cs_datagram_address(client.get(), 1), "2001:db8::1");
  EXPECT_STREQ(cs_datagram_address(client.get(), 2), "");
  out.version = 2;
  EXPECT_EQ(cs_get_datagram_answer(client.get(), &out), 0);
  cs_connecting(client.get(), kMs);
  out.version = CS_DATAGRAM_ANSWER_VERSION;
  EXPECT_EQ(cs_get_datagram_answer(client.get(), &out), 0);
  EXPECT_STREQ(cs_datagram_address(client.get(), 0), "");
}

// Frames by datagrams must not hide that the stream is dead.
TEST(DatagramOffers, FramesProlongNoConnectionWithDatagrams) {
  ScriptedServer server;
  ClientUnderTest client;
  client.receive(server.welcome());
  client.receiveAll(server.chunks());
  client.receive(server.frame(1, codec::PacketKind::key), 1'000 * kMs);
  const std::uint64_t silent = cs_connect_at(client.get());
  client.receive(server.frame(2, codec::PacketKind::predicted), 1'500 * kMs);
  EXPECT_EQ(cs_connect_at(client.get()), silent + 500 * kMs);
  const cs_datagram_offer made = offer();
  ASSERT_EQ(cs_offer_datagrams(client.get(), &made), 1);
  client.receive(serialised(answer()), 2'000 * kMs);
  client.receive(server.frame(3, codec::PacketKind::predicted), 2'500 * kMs);
  EXPECT_EQ(cs_connect_at(client.get()), silent + 1'000 * kMs);
  client.receive(ScriptedServer::pong(1, 2), 3'000 * kMs);
  EXPECT_EQ(cs_connect_at(client.get()), silent + 2'000 * kMs);
}

TEST(DatagramOffers, RefusalMeansNoDatagrams) {
  for (const bool isError : {false, true}) {
    ClientUnderTest client;
    const cs_datagram_offer made = offer();
    ASSERT_EQ(cs_offer_datagrams(client.get(), &made), 1);
    v1::ServerMessage message;
    message.mutable_datagram_answer();
    if (isError) {
      message.mutable_error()->set_code(v1::ERROR_CODE_MALFORMED_MESSAGE);
      message.set_request_id(client.outgoing().back().request_id());
    }
    EXPECT_EQ(client.receive(message.SerializeAsString()), std::uint32_t{CS_EVENT_DATAGRAMS});
    cs_datagram_answer out;
    ASSERT_EQ(cs_get_datagram_answer(client.get(), &out), 1);
    EXPECT_EQ(out.addresses, 0u);
    EXPECT_STREQ(out.ufrag, "");
    EXPECT_STREQ(cs_error_text(client.get()), "");
  }
}

TEST(DatagramOffers, MalformedAnswersFail) {
  const std::vector<std::function<void(v1::DatagramAnswer&)>> mistakes{
      [](v1::DatagramAnswer& message) { message.set_ufrag("a b c"); },
      [](v1::DatagramAnswer& message) { message.clear_ufrag(); },
      [](v1::DatagramAnswer& message) { message.set_password("short"); },
      [](v1::DatagramAnswer& message) { message.set_fingerprint("short"); },
      [](v1::DatagramAnswer& message) { message.clear_fingerprint(); },
      [](v1::DatagramAnswer& message) { message.set_addresses(0, "localhost"); },
      [](v1::DatagramAnswer& message) { message.set_addresses(0, std::string(46, '1')); },
      [](v1::DatagramAnswer& message) { message.set_addresses(0, ""); },
      [](v1::DatagramAnswer& message) { message.clear_port(); },
      [](v1::DatagramAnswer& message) { message.set_port(65'536); },
      [](v1::DatagramAnswer& message) {
        for (int i = 0; i < 15; ++i) message.add_addresses("192.0.2.1");
      },
  };
  for (std::size_t i = 0; i < mistakes.size(); ++i) {
    ClientUnderTest client;
    const cs_datagram_offer made = offer();
    ASSERT_EQ(cs_offer_datagrams(client.get(), &made), 1);
    v1::DatagramAnswer wrong = answer();
    mistakes[i](wrong);
    EXPECT_EQ(client.receive(serialised(wrong)), std::uint32_t{CS_EVENT_ERROR}) << i;
    EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED) << i;
  }
}

// A pair of ways with the datagrams of a server.
class Ways {
 public:
  cs_datagrams* get() const { return datagrams_.get(); }

  bool hold(const std::string& message, std::uint64_t nowUs = 0) {
    return cs_hold_message(get(), bytesOf(message), message.size(), nowUs) != 0;
  }
  bool send(const v1::ClientMessage& message, std::uint64_t nowUs = 0) {
    const std::string bytes = message.SerializeAsString();
    return cs_send_in_datagram(get(), bytesOf(bytes), bytes.size(), nowUs) != 0;
  }
  void receive(const std::string& datagram, std::uint64_t nowUs = 0) {
    const std::vector<std::uint8_t> exact(datagram.begin(), datagram.end());
    cs_receive_datagram(get(), exact.data(), exact.size(), nowUs);
  }
  // Datagrams of a new frame.
  std::vector<std::string> cut(const std::string& message, std::uint64_t nowUs = 0, unsigned parity = 0) {
    const auto bytes = std::as_bytes(std::span(message));
    const auto frame = std::make_shared<const datagram::FramePieces>(
        std::make_shared<const std::vector<std::byte>>(bytes.begin(), bytes.end()), parity + 2);
    const std::uint32_t number = sent_.add(frame, frame->dataPieces() + parity, nowUs);
    std::vector<std::string> out;
    for (unsigned i = 0; i < frame->dataPieces() + parity; ++i) out.push_back(piece(*frame, number, i));
    return out;
  }
  // Pieces that the client requests.
  std::vector<std::string> answer(const datagram::PieceRequest& request, std::uint64_t nowUs) {
    std::vector<std::string> out;
    const auto repeat = sent_.answer(request, nowUs);
    for (unsigned i = 0; repeat && i < repeat->frame->pieces(); ++i)
      if (repeat->pieces[i]) out.push_back(piece(*repeat->frame, repeat->number, i));
    return out;
  }
  void receiveFrame(const std::string& message, std::uint64_t nowUs = 0) {
    for (const std::string& datagram : cut(message, nowUs)) receive(datagram, nowUs);
  }

  std::vector<std::string> messages(std::uint64_t nowUs = 0) { return all(&cs_next_datagram_message, nowUs); }
  std::vector<std::string> datagrams(std::uint64_t nowUs = 0) { return all(&cs_next_datagram, nowUs); }
  std::vector<std::string> streamMessages(std::uint64_t nowUs = 0) {
    return all(&cs_next_stream_message, nowUs);
  }
  cs_datagram_statistics statistics(std::uint64_t nowUs = 0) const {
    cs_datagram_statistics out;
    EXPECT_EQ(cs_get_datagram_statistics(get(), nowUs, &out), 1);
    return out;
  }

 private:
  static const std::uint8_t* bytesOf(const std::string& text) {
    return reinterpret_cast<const std::uint8_t*>(text.data());
  }
  template <typename Next>
  std::vector<std::string> all(Next next, std::uint64_t nowUs) {
    std::vector<std::string> out;
    std::size_t bytes = 0;
    while (const std::uint8_t* message = next(get(), nowUs, &bytes))
      out.emplace_back(reinterpret_cast<const char*>(message), bytes);
    return out;
  }
  std::string piece(const datagram::FramePieces& frame, std::uint32_t number, unsigned index) {
    std::array<std::byte, datagram::kMaxDatagramBytes> out;
    const std::size_t bytes = frame.write({packet_++, 0, number}, index, out);
    return {reinterpret_cast<const char*>(out.data()), bytes};
  }

  std::unique_ptr<cs_datagrams, decltype(&cs_destroy_datagrams)> datagrams_{cs_create_datagrams(),
                                                                            &cs_destroy_datagrams};
  datagram::SentFrames sent_;
  std::uint32_t packet_ = 0;
};

v1::ClientMessage poses(std::uint64_t clientTimeUs = 1) {
  v1::ClientMessage message;
  message.mutable_collider_poses()->set_client_time_us(clientTimeUs);
  return message;
}

v1::ClientMessage acknowledgement(std::uint64_t tick = 1) {
  v1::ClientMessage message;
  message.mutable_frame_ack()->set_tick(tick);
  return message;
}

TEST(TwoWays, FrameWaitsForItsReference) {
  ScriptedServer server;
  Ways ways;
  const std::string key = server.frame(1, codec::PacketKind::key), second = server.frame(2),
                    third = server.frame(3);
  EXPECT_FALSE(ways.hold(key));
  ways.receiveFrame(third, 5 * kMs);
  EXPECT_THAT(ways.messages(5 * kMs), IsEmpty());
  EXPECT_EQ(ways.statistics().held_frames, 1u);
  EXPECT_FALSE(ways.hold(second, 9 * kMs)) << "the late frame of the stream";
  EXPECT_THAT(ways.messages(9 * kMs), ElementsAre(third));
  // And the other way round.
  const std::string fourth = server.frame(4), fifth = server.frame(5);
  EXPECT_TRUE(ways.hold(fifth, 20 * kMs));
  EXPECT_THAT(ways.messages(20 * kMs), IsEmpty());
  ways.receiveFrame(fourth, 30 * kMs);
  EXPECT_THAT(ways.messages(30 * kMs), ElementsAre(fourth, fifth));
}

TEST(TwoWays, FrameWaits150Milliseconds) {
  ScriptedServer server;
  Ways ways;
  EXPECT_FALSE(ways.hold(server.frame(1, codec::PacketKind::key)));
  const std::string lost = server.frame(2), third = server.frame(3), fourth = server.frame(4);
  EXPECT_TRUE(ways.hold(third, 10 * kMs));
  EXPECT_THAT(ways.messages(159 * kMs), IsEmpty());
  EXPECT_EQ(cs_datagrams_due_at(ways.get()), 160 * kMs);
  EXPECT_THAT(ways.messages(160 * kMs), ElementsAre(third));
  EXPECT_FALSE(ways.hold(fourth, 161 * kMs)) << "the client has asked for a key frame by now";
  EXPECT_TRUE(ways.hold(lost, 162 * kMs)) << "it is older than what has passed";
  EXPECT_THAT(ways.messages(500 * kMs), IsEmpty());
}

TEST(TwoWays, OldAndRepeatedFramesAreDropped) {
  ScriptedServer server;
  Ways ways;
  const std::string first = server.frame(1, codec::PacketKind::key), second = server.frame(2);
  const std::string key = server.frame(3, codec::PacketKind::key);
  EXPECT_FALSE(ways.hold(first));
  EXPECT_TRUE(ways.hold(first));
  ways.receiveFrame(key);
  EXPECT_THAT(ways.messages(), ElementsAre(key));
  EXPECT_TRUE(ways.hold(second));
  ways.receiveFrame(key);
  EXPECT_THAT(ways.messages(kMs), IsEmpty());
}

TEST(TwoWays, LostFrameIsNotWaitedForTwice) {
  ScriptedServer server;
  Ways ways;
  EXPECT_FALSE(ways.hold(server.frame(1, codec::PacketKind::key)));
  static_cast<void>(ways.cut(server.frame(2)));  // no piece of it arrives
  const std::string third = server.frame(3);
  ways.receiveFrame(third, 10 * kMs);
  EXPECT_THAT(ways.messages(159 * kMs), IsEmpty());
  EXPECT_THAT(ways.messages(160 * kMs), ElementsAre(third));
  EXPECT_EQ(ways.statistics().lost_frames, 1u);
}

TEST(TwoWays, LossBeforeTheStreamIsForgotten) {
  ScriptedServer server({.cloths = {{"curtain", 64, 64}}});
  Ways ways;
  EXPECT_FALSE(ways.hold(server.frame(1, codec::PacketKind::key)));
  const auto lost = ways.cut(server.frame(2, codec::PacketKind::key));
  ASSERT_GT(lost.size(), 1u);
  ways.receive(lost[0], 10 * kMs);
  EXPECT_THAT(ways.messages(160 * kMs), IsEmpty());
  EXPECT_EQ(ways.statistics().lost_frames, 1u);
  EXPECT_FALSE(ways.hold(server.frame(3, codec::PacketKind::key), 200 * kMs));
  const std::string late = server.frame(4), fifth = server.frame(5);
  ways.receiveFrame(fifth, 210 * kMs);
  EXPECT_THAT(ways.messages(210 * kMs), IsEmpty()) << "its reference may still come by the stream";
  EXPECT_FALSE(ways.hold(late, 220 * kMs));
  EXPECT_THAT(ways.messages(220 * kMs), ElementsAre(fifth));
}

TEST(TwoWays, HeldFramesAreBounded) {
  ScriptedServer server;
  Ways ways;
  EXPECT_FALSE(ways.hold(server.frame(1, codec::PacketKind::key)));
  static_cast<void>(server.frame(2));
  for (std::uint64_t tick = 3; tick < 3 + FrameOrder::kMaxFrames; ++tick) {
    EXPECT_TRUE(ways.hold(server.frame(tick)));
    EXPECT_THAT(ways.messages(), IsEmpty());
  }
  EXPECT_TRUE(ways.hold(server.frame(3 + FrameOrder::kMaxFrames)));
  EXPECT_THAT(ways.messages(), SizeIs(FrameOrder::kMaxFrames + 1));
}

TEST(TwoWays, StreamStartsAnywhere) {
  ScriptedServer server;
  static_cast<void>(server.frame(1, codec::PacketKind::key));
  Ways ways;
  const std::string second = server.frame(2), third = server.frame(3);
  EXPECT_TRUE(ways.hold(second));
  EXPECT_THAT(ways.messages(), ElementsAre(second));
  EXPECT_FALSE(ways.hold(third));
}

TEST(TwoWays, OtherMessagesPassAtOnce) {
  ScriptedServer server;
  Ways ways;
  for (const std::string& message :
       {server.welcome(), ScriptedServer::pong(1, 2), std::string("\xff\xff"), std::string()})
    EXPECT_FALSE(ways.hold(message));
  ways.receiveFrame(ScriptedServer::pong(1, 2));
  EXPECT_THAT(ways.messages(), ElementsAre(ScriptedServer::pong(1, 2)));
}

TEST(DatagramInput, TravelsWhileDatagramsArrive) {
  ScriptedServer server;
  Ways ways;
  EXPECT_FALSE(ways.send(poses()));
  EXPECT_EQ(ways.statistics().in_use, 0);
  ways.receive(std::string("\x01garbage"));
  EXPECT_FALSE(ways.send(poses())) << "garbage does not count";
  ways.receiveFrame(server.frame(1, codec::PacketKind::key), 10 * kMs);
  v1::ClientMessage request, ping, hello;
  request.mutable_key_frame_request();
  ping.mutable_ping()->set_client_time_us(1);
  hello.mutable_hello();
  for (const auto& message : {poses(), acknowledgement(), request}) EXPECT_TRUE(ways.send(message, 11 * kMs));
  for (const auto& message : {ping, hello, v1::ClientMessage()}) EXPECT_FALSE(ways.send(message, 11 * kMs));
  EXPECT_EQ(ways.statistics(509 * kMs).in_use, 1);
  EXPECT_TRUE(ways.send(acknowledgement(), 509 * kMs));
  EXPECT_FALSE(ways.send(acknowledgement(), 510 * kMs)) << "500 ms of silence";
}

TEST(DatagramInput, ArrivesOnceAndInOrder) {
  ScriptedServer server;
  Ways ways;
  ways.receiveFrame(server.frame(1, codec::PacketKind::key));
  static_cast<void>(ways.messages());
  ASSERT_TRUE(ways.send(poses(7)));
  ASSERT_TRUE(ways.send(acknowledgement(9)));
  datagram::InputReceiver receiver;
  std::vector<std::string> arrived;
  const auto deliver = [&](const std::vector<std::string>& datagrams) {
    for (const std::string& datagram : datagrams)
      if (const auto found = receiver.receive(std::as_bytes(std::span(datagram))))
        for (const auto message : *found)
          arrived.emplace_back(reinterpret_cast<const char*>(message.data()), message.size());
  };
  auto sent = ways.datagrams();
  ASSERT_THAT(sent, SizeIs(3)) << "two with input, and a receipt";
  EXPECT_TRUE(datagram::parseReceipt(std::as_bytes(std::span(sent[2]))));
  sent.erase(sent.begin());  // it is lost
  deliver(sent);
  deliver(ways.datagrams(20 * kMs));
  EXPECT_THAT(arrived, ElementsAre(poses(7).SerializeAsString(), acknowledgement(9).SerializeAsString()));
}

TEST(DatagramInput, LastPosesSettleOnTheStream) {
  ScriptedServer server;
  Ways ways;
  ways.receiveFrame(server.frame(1, codec::PacketKind::key));
  ASSERT_TRUE(ways.send(poses(1), 0));
  ASSERT_TRUE(ways.send(poses(2), 50 * kMs));
  EXPECT_THAT(ways.streamMessages(149 * kMs), IsEmpty());
  EXPECT_THAT(ways.streamMessages(150 * kMs), ElementsAre(poses(2).SerializeAsString()));
  EXPECT_THAT(ways.streamMessages(900 * kMs), IsEmpty());
  ASSERT_TRUE(ways.send(poses(3), 200 * kMs));
  ASSERT_FALSE(ways.send(poses(4), 501 * kMs));
  EXPECT_THAT(ways.streamMessages(900 * kMs), IsEmpty()) << "the stream has newer poses";
}

// A server whose window is full sends no frame before an acknowledgement, and then no other one follows.
TEST(DatagramInput, LastAcknowledgementSettlesOnTheStream) {
  ScriptedServer server;
  Ways ways;
  ways.receiveFrame(server.frame(1, codec::PacketKind::key));
  ASSERT_TRUE(ways.send(acknowledgement(), 0));
  ASSERT_TRUE(ways.send(acknowledgement(), 50 * kMs));
  ASSERT_TRUE(ways.send(poses(1), 60 * kMs));
  EXPECT_THAT(ways.streamMessages(149 * kMs), IsEmpty());
  EXPECT_THAT(ways.streamMessages(150 * kMs), ElementsAre(acknowledgement().SerializeAsString()));
  EXPECT_THAT(ways.streamMessages(160 * kMs), ElementsAre(poses(1).SerializeAsString()));
  EXPECT_THAT(ways.streamMessages(900 * kMs), IsEmpty());
}

TEST(DatagramInput, AttachmentsTravelOnTheStream) {
  ScriptedServer server;
  Ways ways;
  ways.receiveFrame(server.frame(1, codec::PacketKind::key));
  v1::ClientMessage attachment = poses(), joints = poses(), large = poses();
  attachment.mutable_collider_poses()->add_attachments()->set_name("rod");
  joints.mutable_collider_poses()->add_joints()->set_collider("arm");
  for (int i = 0; i < 200; ++i)
    large.mutable_collider_poses()->add_colliders()->mutable_pose()->mutable_position()->set_x(1);
  for (const auto& message : {attachment, joints, large}) EXPECT_FALSE(ways.send(message));
  EXPECT_THAT(ways.streamMessages(kMs * 1000), IsEmpty());
}

// A server that sends frames in datagrams over a link that loses and delays packets, and a client.
class LossyLink {
 public:
  explicit LossyLink(double loss) : loss_(loss) {
    client_.join(server_);
    cs_set_datagram_round_trip(ways_.get(), 2 * kDelayUs);
  }

  void run(std::uint64_t frames) {
    for (std::uint64_t tick = 1; tick <= frames; ++tick)
      at(tick * kFrameUs, [this, tick] { sendFrame(tick); });
    while (!events_.empty()) {
      const auto event = events_.extract(events_.begin());
      nowUs_ = event.key();
      event.mapped()();
    }
  }

  cs_statistics client() const { return client_.statistics(nowUs_); }
  cs_datagram_statistics datagrams() const { return ways_.statistics(nowUs_); }
  const std::vector<std::uint64_t>& acknowledged() const { return acknowledged_; }

 private:
  static constexpr std::uint64_t kFrameUs = 13'889, kDelayUs = 25 * kMs;

  void at(std::uint64_t us, std::function<void()> action) { events_.emplace(us, std::move(action)); }
  // Up to 5 ms later than others, which reorders packets.
  template <typename Deliver>
  void carry(std::string datagram, Deliver deliver) {
    if (chance_(random_) < loss_) return;
    const auto jitterUs = static_cast<std::uint64_t>(chance_(random_) * 5'000);
    at(nowUs_ + kDelayUs + jitterUs, [datagram = std::move(datagram), deliver] { deliver(datagram); });
  }
  void sendFrame(std::uint64_t tick) {
    const bool isKey = std::exchange(wantsKey_, false);
    const std::string frame =
        server_.frame(tick, isKey ? codec::PacketKind::key : codec::PacketKind::predicted);
    // Every tenth frame travels on the stream, which is slower.
    if (tick % 10 == 0)
      at(nowUs_ + 2 * kDelayUs, [this, frame] {
        if (!ways_.hold(frame, nowUs_)) client_.receive(frame, nowUs_);
        act();
      });
    else
      down(ways_.cut(frame, nowUs_, 1));
  }
  void down(const std::vector<std::string>& datagrams) {
    for (const std::string& datagram : datagrams)
      carry(datagram, [this](const std::string& arrived) {
        ways_.receive(arrived, nowUs_);
        act();
      });
  }
  void act() {
    for (const std::string& message : ways_.messages(nowUs_)) client_.receive(message, nowUs_);
    for (const v1::ClientMessage& message : client_.outgoing())
      if (!ways_.send(message, nowUs_)) handle(message);
    for (const std::string& datagram : ways_.datagrams(nowUs_))
      carry(datagram, [this](const std::string& arrived) { up(arrived); });
    for (const std::string& message : ways_.streamMessages(nowUs_)) {
      v1::ClientMessage read;
      ASSERT_TRUE(read.ParseFromString(message));
      handle(read);
    }
    const std::uint64_t due = cs_datagrams_due_at(ways_.get());
    ASSERT_GT(due, nowUs_) << "nothing is due once all three functions have returned NULL";
    if (due != UINT64_MAX && events_.find(due) == events_.end()) at(due, [this] { act(); });
  }
  void up(const std::string& datagram) {
    const auto bytes = std::as_bytes(std::span(datagram));
    if (const auto request = datagram::parseRequest(bytes)) return down(ways_.answer(*request, nowUs_));
    if (const auto input = receiver_.receive(bytes))
      for (const auto message : *input) {
        v1::ClientMessage read;
        ASSERT_TRUE(read.ParseFromArray(message.data(), static_cast<int>(message.size())));
        handle(read);
      }
  }
  void handle(const v1::ClientMessage& message) {
    wantsKey_ |= message.has_key_frame_request();
    if (message.has_frame_ack()) acknowledged_.push_back(message.frame_ack().tick());
  }

  const double loss_;
  std::mt19937 random_{3};
  std::uniform_real_distribution<double> chance_{0, 1};
  ScriptedServer server_;
  ClientUnderTest client_;
  Ways ways_;
  datagram::InputReceiver receiver_;
  std::multimap<std::uint64_t, std::function<void()>> events_;
  std::uint64_t nowUs_ = 0;
  bool wantsKey_ = true;
  std::vector<std::uint64_t> acknowledged_;
};

TEST(LossyDatagrams, ClientDecodesFramesOfBothWays) {
  constexpr std::uint64_t kFrames = 500;
  LossyLink whole(0);
  whole.run(kFrames);
  EXPECT_EQ(whole.client().frames, kFrames);
  EXPECT_EQ(whole.client().decode_errors, 0u);
  EXPECT_EQ(whole.client().key_frames, 1u);
  EXPECT_EQ(whole.client().dropped, 0u);
  EXPECT_EQ(whole.datagrams().lost_packets, 0u);
  EXPECT_GE(whole.datagrams().held_frames, kFrames / 10 - 1) << "those after a frame on the stream";

  LossyLink lossy(0.05);
  lossy.run(kFrames);
  const cs_datagram_statistics datagrams = lossy.datagrams();
  EXPECT_EQ(lossy.client().hash_mismatches, 0u);
  EXPECT_GE(lossy.client().frames, kFrames * 98 / 100);
  EXPECT_GT(datagrams.repaired_frames, 10u);
  EXPECT_GT(datagrams.requests, 0u);
  EXPECT_GT(datagrams.parity_packets, kFrames / 2);
  const double sent = static_cast<double>(datagrams.packets + datagrams.lost_packets);
  EXPECT_NEAR(static_cast<double>(datagrams.lost_packets) / sent, 0.05, 0.03);
  EXPECT_TRUE(std::ranges::is_sorted(lossy.acknowledged()));
  EXPECT_GE(lossy.acknowledged().back(), kFrames - 2);
}

}  // namespace
}  // namespace clothstream::client
