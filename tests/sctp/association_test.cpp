// SPDX-License-Identifier: MIT
// Reactions of an association to single packets, and two associations over a simulated link.
#include "proto/sctp/association.h"

#include <string>

#include <gtest/gtest.h>

#include "tests/sctp/bytes.h"
#include "tests/sctp/simulated_link.h"

namespace clothstream::sctp {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t kOwnTag = 0xabcdef01, kOwnTsn = 0xfffffff0;
constexpr std::uint32_t kPeerTag = 0x01020304, kPeerTsn = 0xffffffff;

Init peerInit() {
  return {.tag = kPeerTag,
          .window = 1 << 20,
          .outgoingStreams = 65535,
          .incomingStreams = 65535,
          .tsn = kPeerTsn,
          .forwardTsn = true,
          .reconfig = true};
}

Bytes ping(std::uint32_t offset, bool sackNow = false) {
  return packetOf(kOwnTag, {.tsn = kPeerTsn + offset,
                            .stream = 7,
                            .protocol = 53,
                            .sackNow = sackNow,
                            .payload = bytesOf("ping")});
}

// An association whose peer is the test.
struct AssociationTest : ::testing::Test {
  void receive(const Bytes& packet) { association.receive(now, packet); }
  // The only chunk of the only packet that was sent since the last call.
  Chunk sentChunk() {
    EXPECT_EQ(sent.size(), 1u);
    if (sent.empty()) return {};
    newest = sent.back();
    sent.clear();
    const std::vector<Chunk> chunks = chunksOf(newest);
    EXPECT_EQ(chunks.size(), 1u);
    return chunks.empty() ? Chunk{} : chunks[0];
  }
  std::uint32_t sentTag() const { return parsePacket(newest)->tag; }
  Sack sentSack() {
    const Chunk chunk = sentChunk();
    EXPECT_EQ(chunk.type, ChunkType::sack);
    return parseSack(chunk).value_or(Sack{});
  }
  void establish(const Init& init = peerInit()) {
    receive(packetOf(0, ChunkType::init, init));
    const auto answer = parseInit(sentChunk());
    ASSERT_TRUE(answer);
    const Bytes cookie(answer->cookie.begin(), answer->cookie.end());
    receive(packetOf(kOwnTag, ChunkType::cookieEcho, 0, cookie));
    EXPECT_EQ(sentChunk().type, ChunkType::cookieAck);
    EXPECT_TRUE(association.isConnected());
  }
  SendResult send(std::size_t bytes = 100) {
    const Bytes payload(bytes, std::byte{1});
    return association.send(now, {.stream = 7, .protocol = 53, .payload = payload}, false);
  }
  void waitFor(Duration duration) {
    const Time end = now + duration;
    while (association.deadline() <= end) {
      now = association.deadline();
      association.advance(now);
    }
    now = end;
  }

  Time now = Time{} + 1h;
  std::vector<Bytes> sent;
  Bytes newest;
  std::vector<std::string> delivered;
  std::vector<std::optional<std::uint16_t>> resets;
  Association association{
      {.tag = kOwnTag, .firstTsn = kOwnTsn},
      {.transmit =
           [this](std::span<const std::byte> packet) { sent.emplace_back(packet.begin(), packet.end()); },
       .deliver =
           [this](const Message& message) {
             delivered.emplace_back(reinterpret_cast<const char*>(message.payload.data()),
                                    message.payload.size());
           },
       .reset = [this](std::optional<std::uint16_t> stream) { resets.push_back(stream); }}};
};

TEST_F(AssociationTest, AnswersInit) {
  Init init = peerInit();
  const Bytes odd = bytesOf({0xdf, 1, 0, 5, 1, 0, 0, 0});
  Bytes value(initBytes(init));
  writeInit(value, init);
  receive(packetOf(0, ChunkType::init, 0, join({value, odd})));
  const Chunk chunk = sentChunk();
  EXPECT_EQ(chunk.type, ChunkType::initAck);
  EXPECT_EQ(sentTag(), kPeerTag);
  const auto answer = parseInit(chunk);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->tag, kOwnTag);
  EXPECT_EQ(answer->tsn, kOwnTsn);
  EXPECT_EQ(answer->window, Association::kWindowBytes);
  EXPECT_TRUE(answer->forwardTsn && answer->reconfig && answer->zeroChecksum);
  EXPECT_EQ(answer->cookie.size(), 8u);
  // The unknown parameter is reported with its header and without padding.
  const Bytes reported = bytesOf({0, 8, 0, 9, 0xdf, 1, 0, 5, 1});
  EXPECT_FALSE(std::ranges::search(chunk.value, reported).empty());
  EXPECT_FALSE(association.isConnected());
  EXPECT_EQ(association.deadline(), kNever);
}

TEST_F(AssociationTest, RefusesPeerWithoutForwardTsn) {
  Init init = peerInit();
  init.forwardTsn = false;
  receive(packetOf(0, ChunkType::init, init));
  const Chunk chunk = sentChunk();
  EXPECT_EQ(chunk.type, ChunkType::abort);
  EXPECT_TRUE(std::ranges::equal(chunk.value, bytesOf({0, 2, 0, 10, 0, 0, 0, 1, 0xc0, 0})));
  EXPECT_TRUE(association.hasEnded());
  EXPECT_NE(association.endReason().find("FORWARD-TSN"), std::string_view::npos);
}

TEST_F(AssociationTest, ForgedCookieIsIgnored) {
  const Bytes cookie = bytesOf({0xab, 0xcd, 0xef, 1, 1, 2, 3, 4});
  receive(packetOf(kOwnTag, ChunkType::cookieEcho, 0, cookie));
  EXPECT_TRUE(sent.empty());  // without INIT
  receive(packetOf(0, ChunkType::init, peerInit()));
  sent.clear();
  for (std::size_t i = 0; i < cookie.size(); ++i) {
    Bytes forged = cookie;
    forged[i] ^= std::byte{1};
    receive(packetOf(kOwnTag, ChunkType::cookieEcho, 0, forged));
  }
  EXPECT_FALSE(association.isConnected());
  receive(packetOf(kOwnTag, ChunkType::cookieEcho, 0, cookie));
  EXPECT_TRUE(association.isConnected());
}

TEST_F(AssociationTest, RepeatedHandshakeChangesNothing) {
  establish();
  receive(packetOf(0, ChunkType::init, peerInit()));
  Init other = peerInit();
  other.tag = 9;
  receive(packetOf(0, ChunkType::init, other));
  receive(packetOf(kOwnTag, ChunkType::initAck, peerInit()));
  receive(packetOf(kOwnTag, ChunkType::cookieAck, 0, {}));
  EXPECT_TRUE(sent.empty());
  // The COOKIE ACK was lost.
  receive(packetOf(kOwnTag, ChunkType::cookieEcho, 0, bytesOf({0xab, 0xcd, 0xef, 1, 1, 2, 3, 4})));
  EXPECT_EQ(sentChunk().type, ChunkType::cookieAck);
  EXPECT_TRUE(association.isConnected());
}

TEST_F(AssociationTest, OtherTagsAreIgnored) {
  establish();
  receive(packetOf(kOwnTag + 1, ChunkType::heartbeat, 0, bytesOf({0, 1, 0, 4})));
  receive(packetOf(kPeerTag, ChunkType::abort, 0, {}));
  receive(packetOf(kOwnTag, ChunkType::abort, 1, {}));  // T bit: carries the tag of its receiver
  EXPECT_TRUE(sent.empty());
  EXPECT_TRUE(association.isConnected());
  receive(packetOf(kPeerTag, ChunkType::abort, 1, {}));
  EXPECT_TRUE(association.hasEnded());
}

TEST_F(AssociationTest, SendsEachMessageOnce) {
  EXPECT_EQ(send(), SendResult::notConnected);
  establish();
  EXPECT_EQ(send(0), SendResult::badSize);
  EXPECT_EQ(send(kMaxPayloadBytes + 1), SendResult::badSize);
  EXPECT_EQ(send(kMaxPayloadBytes), SendResult::sent);
  const auto data = parseData(sentChunk());
  ASSERT_TRUE(data);
  EXPECT_EQ(data->tsn, kOwnTsn);
  EXPECT_EQ(data->stream, 7);
  EXPECT_EQ(data->protocol, 53u);
  EXPECT_TRUE(data->unordered && !data->sackNow && !data->fragment);
  EXPECT_EQ(data->payload.size(), kMaxPayloadBytes);
  waitFor(1min);
  EXPECT_TRUE(sent.empty());
  EXPECT_EQ(association.deadline(), kNever);
}

TEST_F(AssociationTest, GapIsGivenUpInTime) {
  establish();
  for (int i = 0; i < 4; ++i) EXPECT_EQ(send(), SendResult::sent);
  sent.clear();
  const GapBlock gap{2, 3};
  receive(sackPacket(kOwnTag, kOwnTsn, 1 << 20, {&gap, 1}));
  waitFor(29ms);
  EXPECT_TRUE(sent.empty());
  waitFor(1ms);
  const Chunk chunk = sentChunk();
  EXPECT_EQ(chunk.type, ChunkType::forwardTsn);
  ASSERT_EQ(chunk.value.size(), 4u);
  EXPECT_EQ(read32(chunk.value, 0), kOwnTsn + 3);
}

TEST_F(AssociationTest, FullWindowDropsMessages) {
  Init init = peerInit();
  init.window = 5 * kMaxPayloadBytes;
  establish(init);
  for (int i = 0; i < 5; ++i) EXPECT_EQ(send(), SendResult::sent);
  EXPECT_EQ(send(), SendResult::full);
  receive(sackPacket(kOwnTag, kOwnTsn + 1, init.window));
  EXPECT_EQ(send(), SendResult::sent);
  EXPECT_EQ(send(), SendResult::sent);
  EXPECT_EQ(send(), SendResult::full);
  now += SentTsns::kSilence;  // nothing of it has arrived
  EXPECT_EQ(send(), SendResult::sent);
}

TEST_F(AssociationTest, ReliableMessageIsRepeated) {
  establish();
  const Message message{.stream = 3, .protocol = 50, .payload = bytesOf("open")};
  EXPECT_EQ(association.sendReliable(now, message), SendResult::sent);
  for (const Duration pause :
       {Duration{}, Duration{100ms}, Duration{200ms}, Duration{400ms}, Duration{800ms}, Duration{800ms}}) {
    EXPECT_TRUE(sent.empty() || pause == 0ms);
    waitFor(pause);
    const auto data = parseData(sentChunk());
    ASSERT_TRUE(data);
    EXPECT_EQ(data->tsn, kOwnTsn);
    EXPECT_FALSE(data->unordered);
    EXPECT_TRUE(std::ranges::equal(data->payload, bytesOf("open")));
  }
  receive(sackPacket(kOwnTag, kOwnTsn, 1 << 20));
  EXPECT_EQ(association.deadline(), kNever);
}

TEST_F(AssociationTest, ReliableMessagesAreBounded) {
  establish();
  const Message message{.stream = 3, .protocol = 50, .payload = bytesOf("open")};
  for (std::size_t i = 0; i < Association::kMaxReliable; ++i)
    EXPECT_EQ(association.sendReliable(now, message), SendResult::sent);
  EXPECT_EQ(association.sendReliable(now, message), SendResult::full);
}

TEST_F(AssociationTest, SilentPeerEndsIt) {
  establish();
  const Message message{.stream = 3, .protocol = 50, .payload = bytesOf("open")};
  EXPECT_EQ(association.sendReliable(now, message), SendResult::sent);
  const Time begin = now;
  while (!association.hasEnded()) {
    ASSERT_NE(association.deadline(), kNever);
    association.advance(now = association.deadline());
  }
  EXPECT_EQ(now - begin, 100ms + 200ms + 400ms + 8 * 800ms);
  EXPECT_EQ(sent.size(), 1u + Association::kMaxRepeats + 1);
  EXPECT_EQ(chunksOf(sent.back()).at(0).type, ChunkType::abort);
  EXPECT_EQ(association.deadline(), kNever);
}

TEST_F(AssociationTest, SecondPacketIsAcknowledged) {
  establish();
  receive(ping(0));
  EXPECT_TRUE(sent.empty());
  EXPECT_EQ(association.deadline(), now + 20ms);
  receive(ping(1));
  EXPECT_EQ(sentSack().cumulative, kPeerTsn + 1);
  EXPECT_EQ(association.deadline(), kNever);
  receive(ping(2));
  waitFor(20ms);
  const Sack sack = sentSack();
  EXPECT_EQ(sack.cumulative, kPeerTsn + 2);
  EXPECT_EQ(sack.window, Association::kWindowBytes);
  EXPECT_EQ(delivered, (std::vector<std::string>{"ping", "ping", "ping"}));
}

TEST_F(AssociationTest, AcknowledgesAtOnceWhenAsked) {
  establish();
  receive(ping(0, true));
  EXPECT_EQ(sentSack().cumulative, kPeerTsn);
}

TEST_F(AssociationTest, AcknowledgesGapsAndDuplicatesAtOnce) {
  establish();
  receive(ping(1));
  Sack sack = sentSack();
  EXPECT_EQ(sack.cumulative, kPeerTsn - 1);
  EXPECT_EQ(sack.highest, kPeerTsn + 1);
  receive(ping(1));
  sack = sentSack();
  EXPECT_EQ(sack.highest, kPeerTsn + 1);
  EXPECT_EQ(delivered.size(), 1u);
  receive(ping(0));
  receive(ping(0));
  EXPECT_EQ(sentSack().cumulative, kPeerTsn + 1);
  EXPECT_EQ(delivered.size(), 2u);
  receive(ping(5000));  // too far ahead: neither delivered nor acknowledged
  EXPECT_EQ(sentSack().highest, kPeerTsn + 1);
  EXPECT_EQ(delivered.size(), 2u);
}

TEST_F(AssociationTest, AcknowledgementTravelsWithMessage) {
  establish();
  receive(ping(0));
  EXPECT_EQ(send(1000), SendResult::sent);
  ASSERT_EQ(sent.size(), 1u);
  const std::vector<Chunk> chunks = chunksOf(sent[0]);
  ASSERT_EQ(chunks.size(), 2u);
  EXPECT_EQ(chunks[0].type, ChunkType::sack);
  EXPECT_EQ(chunks[1].type, ChunkType::data);
  EXPECT_EQ(association.deadline(), kNever);
  receive(ping(1));
  EXPECT_EQ(send(kMaxPayloadBytes), SendResult::sent);  // no room for both
  EXPECT_EQ(association.deadline(), now + 20ms);
}

TEST_F(AssociationTest, ForwardTsnClosesGap) {
  establish();
  receive(ping(3));
  sent.clear();
  Bytes value(4);
  write32(value, 0, kPeerTsn + 2);
  receive(packetOf(kOwnTag, ChunkType::forwardTsn, 0, value));
  waitFor(20ms);
  EXPECT_EQ(sentSack().cumulative, kPeerTsn + 3);
  receive(packetOf(kOwnTag, ChunkType::forwardTsn, 0, value));  // a late one
  EXPECT_EQ(sentSack().cumulative, kPeerTsn + 3);
  receive(packetOf(kOwnTag, ChunkType::forwardTsn, 0, bytesOf({1, 2, 3})));
  receive(ping(1));
  EXPECT_EQ(delivered.size(), 1u);
}

TEST_F(AssociationTest, FragmentsAreDropped) {
  establish();
  Bytes value = join({Bytes(12), bytesOf({1})});
  write32(value, 0, kPeerTsn);
  receive(packetOf(kOwnTag, ChunkType::data, 6, value));  // beginning of a message
  write32(value, 0, kPeerTsn + 1);
  receive(packetOf(kOwnTag, ChunkType::data, 5, value));  // its end
  EXPECT_EQ(sentSack().cumulative, kPeerTsn + 1);
  EXPECT_TRUE(delivered.empty());
}

TEST_F(AssociationTest, UnofferedStreamIsDropped) {
  establish();
  for (const std::uint16_t stream : {Association::kStreams, std::uint16_t{Association::kStreams - 1}})
    receive(packetOf(kOwnTag, {.tsn = kPeerTsn + Association::kStreams - stream,
                               .stream = stream,
                               .protocol = 53,
                               .payload = bytesOf("ping")}));
  EXPECT_EQ(sentSack().cumulative, kPeerTsn + 1);
  EXPECT_EQ(delivered.size(), 1u);
}

TEST_F(AssociationTest, OtherInitIsIgnoredAfterInitAck) {
  association.connect(now);
  EXPECT_EQ(sentChunk().type, ChunkType::init);
  const Bytes cookie = bytesOf({5, 6, 7, 8});
  Init init = peerInit();
  init.cookie = cookie;
  receive(packetOf(kOwnTag, ChunkType::initAck, init));
  const Chunk echo = sentChunk();
  EXPECT_EQ(echo.type, ChunkType::cookieEcho);
  EXPECT_TRUE(std::ranges::equal(echo.value, cookie));
  Init other = peerInit();
  other.tag = 9;
  receive(packetOf(0, ChunkType::init, other));
  EXPECT_TRUE(sent.empty());
  receive(packetOf(0, ChunkType::init, peerInit()));  // both ends connect
  EXPECT_EQ(sentChunk().type, ChunkType::initAck);
  receive(packetOf(kOwnTag, ChunkType::cookieAck, 0, {}));
  EXPECT_TRUE(association.isConnected());
  EXPECT_EQ(send(), SendResult::sent);
  EXPECT_EQ(sentChunk().type, ChunkType::data);
  EXPECT_EQ(sentTag(), kPeerTag);
}

TEST_F(AssociationTest, EmptyMessageEndsIt) {
  establish();
  Bytes value(12);
  write32(value, 0, kPeerTsn);
  receive(packetOf(kOwnTag, ChunkType::data, 7, value));
  const Chunk chunk = sentChunk();
  EXPECT_EQ(chunk.type, ChunkType::abort);
  EXPECT_TRUE(std::ranges::equal(chunk.value, bytesOf({0, 9, 0, 8, 255, 255, 255, 255})));
  EXPECT_TRUE(association.hasEnded());
}

TEST_F(AssociationTest, AnswersHeartbeat) {
  establish();
  const Bytes info = bytesOf({0, 1, 0, 9, 1, 2, 3, 4, 5});
  receive(packetOf(kOwnTag, ChunkType::heartbeat, 0, info));
  const Chunk chunk = sentChunk();
  EXPECT_EQ(chunk.type, ChunkType::heartbeatAck);
  EXPECT_TRUE(std::ranges::equal(chunk.value, info));
}

TEST_F(AssociationTest, UnknownChunksFollowTheirBits) {
  establish();
  // Stop; stop and report; skip; skip and report. An acknowledgement shows whether DATA behind it was read.
  for (const auto& [type, reports, reads] :
       {std::tuple{0x3f, false, false}, {0x7f, true, false}, {0xbf, false, true}, {0xff, true, true}}) {
    PacketWriter writer;
    writer.start(kOwnTag);
    writer.add(static_cast<ChunkType>(type), 0, 1);
    const Data data{.tsn = kPeerTsn, .protocol = 53, .sackNow = true, .payload = bytesOf("x")};
    writeData(writer.add(ChunkType::data, dataFlags(data), dataBytes(data)), data);
    const auto packet = writer.finish(false);
    sent.clear();
    association.receive(now, packet);
    std::vector<ChunkType> types;
    if (!sent.empty())
      for (const Chunk& chunk : chunksOf(sent[0])) types.push_back(chunk.type);
    EXPECT_EQ(std::ranges::count(types, ChunkType::error), reports) << type;
    EXPECT_EQ(std::ranges::count(types, ChunkType::sack), reads) << type;
    if (reports) {
      const auto whole = static_cast<unsigned>(type);
      EXPECT_TRUE(std::ranges::equal(chunksOf(sent[0])[0].value, bytesOf({0, 6, 0, 9, whole, 0, 0, 5, 0})));
    }
  }
}

TEST_F(AssociationTest, ShutdownIsAnswered) {
  establish();
  receive(packetOf(kOwnTag, ChunkType::shutdown, 0, Bytes(4)));
  EXPECT_EQ(sentChunk().type, ChunkType::shutdownAck);
  EXPECT_TRUE(association.hasEnded());
  EXPECT_EQ(association.endReason(), "the peer shut the association down");
  EXPECT_EQ(send(), SendResult::notConnected);
  receive(packetOf(kOwnTag, ChunkType::shutdown, 0, Bytes(4)));
  EXPECT_EQ(sentChunk().type, ChunkType::shutdownAck);
  receive(packetOf(kOwnTag, ChunkType::shutdownComplete, 0, {}));
  receive(packetOf(kOwnTag, ChunkType::shutdown, 0, Bytes(4)));
  EXPECT_TRUE(sent.empty());
}

TEST_F(AssociationTest, AbortIsSentOnce) {
  establish();
  association.abort("scene ends");
  const Chunk chunk = sentChunk();
  EXPECT_EQ(chunk.type, ChunkType::abort);
  EXPECT_EQ(sentTag(), kPeerTag);
  EXPECT_TRUE(std::ranges::equal(chunk.value.subspan(4), bytesOf("scene ends")));
  association.abort("again");
  receive(ping(0));
  EXPECT_TRUE(sent.empty());
  EXPECT_EQ(association.endReason(), "scene ends");
}

TEST_F(AssociationTest, StreamIsReset) {
  establish();
  association.resetStream(now, 9);
  const Chunk request = sentChunk();
  EXPECT_EQ(request.type, ChunkType::reconfig);
  Bytes response = bytesOf({0, 16, 0, 12, 0, 0, 0, 0, 0, 0, 0, 1});
  write32(response, 4, kOwnTsn);
  waitFor(100ms);
  EXPECT_EQ(sentChunk().type, ChunkType::reconfig);
  receive(packetOf(kOwnTag, ChunkType::reconfig, 0, response));
  EXPECT_EQ(association.deadline(), kNever);
  Bytes theirs = bytesOf({0, 13, 0, 18, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 4});
  write32(theirs, 4, kPeerTsn);
  receive(packetOf(kOwnTag, ChunkType::reconfig, 0, theirs));
  EXPECT_EQ(sentChunk().type, ChunkType::reconfig);
  EXPECT_EQ(resets, (std::vector<std::optional<std::uint16_t>>{4}));
}

TEST_F(AssociationTest, ResetNeedsPeerThatKnowsIt) {
  Init init = peerInit();
  init.reconfig = false;
  establish(init);
  association.resetStream(now, 9);
  EXPECT_TRUE(sent.empty());
}

TEST_F(AssociationTest, ChecksumIsLeftOutIfAccepted) {
  const auto checksum = [this] { return read32(sent.back(), 8); };
  establish();
  EXPECT_EQ(send(), SendResult::sent);
  EXPECT_NE(checksum(), 0u);
}

TEST_F(AssociationTest, ChecksumStaysInHandshake) {
  const auto checksum = [this] { return read32(newest, 8); };
  Init init = peerInit();
  init.zeroChecksum = true;
  receive(packetOf(0, ChunkType::init, init));
  sentChunk();
  EXPECT_NE(checksum(), 0u);
  establish(init);
  EXPECT_EQ(send(), SendResult::sent);
  sentChunk();
  EXPECT_EQ(checksum(), 0u);
}

TEST_F(AssociationTest, CallbackMaySendAndAbort) {
  std::vector<Bytes> packets;
  Association* self = nullptr;
  int calls = 0;
  Association other(
      {.tag = kOwnTag, .firstTsn = kOwnTsn},
      {.transmit =
           [&](std::span<const std::byte> packet) { packets.emplace_back(packet.begin(), packet.end()); },
       .deliver =
           [&](const Message& message) {
             ++calls;
             EXPECT_EQ(self->send(now, message, false), SendResult::sent);
             self->abort("enough");
           },
       .reset = [](std::optional<std::uint16_t>) {}});
  self = &other;
  other.receive(now, packetOf(0, ChunkType::init, peerInit()));
  other.receive(now, packetOf(kOwnTag, ChunkType::cookieEcho, 0, bytesOf({0xab, 0xcd, 0xef, 1, 1, 2, 3, 4})));
  packets.clear();
  PacketWriter writer;
  writer.start(kOwnTag);
  for (std::uint32_t i = 0; i < 2; ++i) {
    const Data data{.tsn = kPeerTsn + i, .protocol = 53, .payload = bytesOf("x")};
    writeData(writer.add(ChunkType::data, dataFlags(data), dataBytes(data)), data);
  }
  other.receive(now, writer.finish(false));
  EXPECT_EQ(calls, 1);
  ASSERT_EQ(packets.size(), 2u);
  EXPECT_EQ(chunksOf(packets[0]).at(0).type, ChunkType::data);
  EXPECT_EQ(chunksOf(packets[1]).at(0).type, ChunkType::abort);
}

TEST_F(AssociationTest, HostileWordsAreIgnoredBeforeHandshake) {
  for (int type = 0; type < 256; ++type) {
    if (type == static_cast<int>(ChunkType::init) || type == static_cast<int>(ChunkType::abort)) continue;
    for (const std::size_t size : {0u, 4u, 16u, 40u})
      receive(packetOf(kOwnTag, static_cast<ChunkType>(type), 3, Bytes(size)));
  }
  EXPECT_TRUE(sent.empty());
  EXPECT_FALSE(association.hasEnded());
  establish();
}

// Two associations over a link, of which the first one connects.
struct Two {
  explicit Two(const SimulatedLink::Faults& faults, std::uint32_t seed = 1) : link(faults, seed) {
    link.attach(endOf(first), endOf(second));
  }
  Association::Callbacks callbacks(std::size_t end) {
    return {.transmit = [this, end](std::span<const std::byte> packet) { link.send(end, packet); },
            .deliver =
                [this, end](const Message& message) {
                  delivered[end].emplace_back(reinterpret_cast<const char*>(message.payload.data()),
                                              message.payload.size());
                },
            .reset = [](std::optional<std::uint16_t>) {}};
  }
  bool areConnected() const { return first.isConnected() && second.isConnected(); }

  SimulatedLink link;
  std::array<std::vector<std::string>, 2> delivered;
  Association first{{.tag = 1, .firstTsn = 0xfffffffe}, callbacks(0)};
  Association second{{.tag = 2, .firstTsn = 0x7fffffff}, callbacks(1)};
};

TEST(AssociationPair, HandshakeSurvivesEveryLoss) {
  for (const bool bothConnect : {false, true}) {
    for (std::size_t end = 0; end < 2; ++end) {
      for (std::size_t lost = 0; lost < 6; ++lost) {
        Two two({});
        two.link.losesToo = [&](std::size_t from, std::size_t number) {
          return from == end && number == lost;
        };
        two.first.connect(two.link.now());
        if (bothConnect) two.second.connect(two.link.now());
        two.link.run(300ms);
        EXPECT_TRUE(two.areConnected()) << bothConnect << " loses packet " << lost << " of end " << end;
        const Message message{.protocol = 53, .payload = bytesOf("hello")};
        EXPECT_EQ(two.first.sendReliable(two.link.now(), message), SendResult::sent);
        EXPECT_EQ(two.second.sendReliable(two.link.now(), message), SendResult::sent);
        two.link.run(300ms);
        for (const auto& messages : two.delivered) EXPECT_EQ(messages, std::vector<std::string>{"hello"});
      }
    }
  }
}

TEST(AssociationPair, UnansweredConnectEnds) {
  Two two({.loss = 1});
  two.first.connect(two.link.now());
  two.link.run(10s);
  EXPECT_TRUE(two.first.hasEnded());
  EXPECT_EQ(two.first.endReason(), "the peer does not acknowledge");
  EXPECT_FALSE(two.second.hasEnded());
}

TEST(AssociationPair, BadLinkLosesOnlyItsLosses) {
  for (std::uint32_t seed = 0; seed < 5; ++seed) {
    Two two({.loss = 0.1, .duplication = 0.05, .delay = 20ms, .jitter = 15ms}, seed);
    two.first.connect(two.link.now());
    two.link.run(3s);
    ASSERT_TRUE(two.areConnected());
    std::array<std::size_t, 2> lost{};
    two.link.watch = [&](std::size_t from, std::span<const std::byte> packet, bool isLost) {
      for (const Chunk& chunk : chunksOf(packet)) lost[from] += isLost && chunk.type == ChunkType::data;
    };
    constexpr int kMessages = 1000;
    for (int i = 0; i < kMessages; ++i) {
      const std::string text = std::to_string(i);
      const Message message{.protocol = 53, .payload = bytesOf(text)};
      EXPECT_EQ(two.first.send(two.link.now(), message, i % 8 == 0), SendResult::sent);
      EXPECT_EQ(two.second.send(two.link.now(), message, false), SendResult::sent);
      two.link.run(3ms);
    }
    two.link.run(1s);
    for (std::size_t end = 0; end < 2; ++end) {
      std::ranges::sort(two.delivered[end]);
      EXPECT_EQ(two.delivered[end].size(), kMessages - lost[1 - end]);
      EXPECT_EQ(std::ranges::adjacent_find(two.delivered[end]), two.delivered[end].end());
    }
  }
}

TEST(AssociationPair, StalledLinkGoesOn) {
  Two two({.delay = 25ms});
  two.first.connect(two.link.now());
  two.link.run(1s);
  ASSERT_TRUE(two.areConnected());
  bool stalled = true;
  two.link.losesToo = [&](std::size_t, std::size_t) { return stalled; };
  const Bytes payload(1000);
  int full = 0;
  for (int i = 0; i < 1000; ++i) {
    full += two.first.send(two.link.now(), {.protocol = 53, .payload = payload}, false) == SendResult::full;
    two.link.run(1ms);
  }
  // The window of 128 KiB is one for 113 messages of full size.
  EXPECT_EQ(full, 1000 - 113);
  stalled = false;
  EXPECT_EQ(two.first.send(two.link.now(), {.protocol = 53, .payload = payload}, true), SendResult::sent);
  two.link.run(200ms);
  EXPECT_EQ(two.delivered[1].size(), 1u);
  for (int i = 0; i < 500; ++i) {
    EXPECT_EQ(two.first.send(two.link.now(), {.protocol = 53, .payload = payload}, false), SendResult::sent);
    two.link.run(1ms);
  }
  two.link.run(200ms);
  EXPECT_EQ(two.delivered[1].size(), 501u);
}

// Gaps of the receiver, as its acknowledgements show them, close after a round trip and twice the patience.
TEST(AssociationPair, GapsCloseInTime) {
  Two two({.loss = 0.05, .delay = 10ms});
  two.first.connect(two.link.now());
  two.link.run(3s);
  ASSERT_TRUE(two.areConnected());
  std::uint32_t cumulative = 0;
  Time since = kNever;  // the receiver waits for the number after `cumulative`
  Duration longest{};
  two.link.watch = [&](std::size_t from, std::span<const std::byte> packet, bool) {
    for (const Chunk& chunk : chunksOf(packet)) {
      const auto sack = from == 1 && chunk.type == ChunkType::sack ? parseSack(chunk) : std::nullopt;
      if (!sack) continue;
      if (sack->cumulative != cumulative || sack->highest == sack->cumulative) since = two.link.now();
      cumulative = sack->cumulative;
      longest = std::max(longest, two.link.now() - since);
    }
  };
  const Bytes payload(500);
  for (int i = 0; i < 5000; ++i) {
    EXPECT_EQ(two.first.send(two.link.now(), {.protocol = 53, .payload = payload}, false), SendResult::sent);
    two.link.run(2ms);
  }
  EXPECT_GE(longest, 30ms);
  // One FORWARD-TSN or acknowledgement in a row may be lost, too.
  EXPECT_LE(longest, 2 * (20ms + 2 * 30ms));
}

}  // namespace
}  // namespace clothstream::sctp
