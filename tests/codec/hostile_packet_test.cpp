// SPDX-License-Identifier: MIT
#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "tests/codec/golden.h"
#include "tests/codec/motion.h"

namespace clothstream::codec {
namespace {

constexpr std::uint64_t kLateTick = 1'000'000;

// A decoder with the stream's first packets, and an encoder for a key frame after all of them.
class Victim {
 public:
  explicit Victim(const GoldenStream& stream) : stream_(stream), encoder_(Encoder::make(stream.layout)) {}

  void receiveUpTo(std::size_t packet) {
    decoder_ = Decoder::make(stream_.layout);
    for (std::size_t i = 0; i < packet; ++i) {
      ASSERT_EQ(decoder_->decode(stream_.packets[i].bytes), DecodeResult::ok);
    }
  }

  // Copies the bytes to memory of exactly their size, so that the address sanitizer detects a read past the
  // end.
  DecodeResult receive(std::span<const std::byte> bytes) {
    const auto copy = std::make_unique<std::byte[]>(bytes.size());
    if (!bytes.empty()) std::memcpy(copy.get(), bytes.data(), bytes.size());
    return decoder_->decode({copy.get(), bytes.size()});
  }

  void expectState(std::size_t packet) {
    ASSERT_EQ(decoder_->hasFrame(), packet > 0);
    if (packet == 0) return;
    const GoldenPacket& last = stream_.packets[packet - 1];
    EXPECT_EQ(decoder_->tick(), last.tick);
    EXPECT_EQ(decoder_->reconstructionHash(), last.reconstructionHash);
    EXPECT_EQ(hashFloats(decoder_->positions()), last.positionsHash);
  }

  void expectKeyFrameIsDecoded() {
    const MotionFrame frame = sampleMotion(stream_.layout, 9, 0.1f);
    std::vector<std::byte> packet(encoder_->packetBound());
    encoder_->forgetHistory();
    const std::size_t bytes =
        encoder_->encode(++tick_, PacketKind::key, frame.positions, frame.normals, packet);
    EXPECT_EQ(decoder_->decode(std::span(packet).first(bytes)), DecodeResult::ok);
    EXPECT_EQ(decoder_->reconstructionHash(), encoder_->reconstructionHash());
  }

  Decoder& decoder() { return *decoder_; }

 private:
  const GoldenStream& stream_;
  std::unique_ptr<Encoder> encoder_;
  std::unique_ptr<Decoder> decoder_;
  std::uint64_t tick_ = kLateTick;
};

TEST(HostilePacket, TruncationIsRefusedAndChangesNothing) {
  for (const GoldenStream& stream : readGoldenStreams()) {
    Victim victim(stream);
    for (std::size_t p = 0; p < stream.packets.size(); ++p) {
      const std::span<const std::byte> bytes = stream.packets[p].bytes;
      victim.receiveUpTo(p);
      for (std::size_t size = 0; size < bytes.size(); ++size) {
        ASSERT_EQ(victim.receive(bytes.first(size)), DecodeResult::malformed)
            << stream.packets[p].file << ' ' << size;
      }
      victim.expectState(p);
      EXPECT_EQ(victim.receive(bytes), DecodeResult::ok);
      victim.expectState(p + 1);
    }
  }
}

TEST(HostilePacket, FlippedBitLeavesTheDecoderUsable) {
  for (const GoldenStream& stream : readGoldenStreams()) {
    Victim victim(stream);
    for (std::size_t p = 0; p < stream.packets.size(); ++p) {
      victim.receiveUpTo(p);
      std::vector<std::byte> bytes = stream.packets[p].bytes;
      for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        const std::byte mask{static_cast<std::uint8_t>(1u << bit % 8)};
        bytes[bit / 8] ^= mask;
        const DecodeResult result = victim.receive(bytes);
        bytes[bit / 8] ^= mask;
        if (result != DecodeResult::ok) continue;
        for (const float x : victim.decoder().positions()) ASSERT_TRUE(std::isfinite(x));
        for (const float x : victim.decoder().normals()) ASSERT_TRUE(std::isfinite(x));
        // A flipped bit of the tick can put the decoder far ahead, so it restarts.
        victim.receiveUpTo(p);
      }
      victim.expectState(p);
      victim.expectKeyFrameIsDecoded();
    }
  }
}

TEST(HostilePacket, RefusedIfOfAnotherEpoch) {
  const std::vector<GoldenStream> streams = readGoldenStreams();
  StreamLayout layout = streams[0].layout;
  layout.epoch += 1;
  EXPECT_EQ(Decoder::make(layout)->decode(streams[0].packets[0].bytes), DecodeResult::wrongEpoch);
}

TEST(HostilePacket, RefusedIfOfAnotherLayout) {
  const std::vector<GoldenStream> streams = readGoldenStreams();
  StreamLayout larger = streams[0].layout, withNormals = streams[0].layout, fewer = streams[0].layout;
  larger.cloths[0] = {.vertexCount = 9 * 8, .rows = 9, .columns = 8};
  withNormals.normals = NormalMode::octahedral;
  fewer.cloths.pop_back();
  for (const StreamLayout& layout : {larger, withNormals, fewer}) {
    EXPECT_EQ(Decoder::make(layout)->decode(streams[0].packets[0].bytes), DecodeResult::malformed);
  }
}

TEST(HostilePacket, MissingReferenceIsReported) {
  for (const GoldenStream& stream : readGoldenStreams()) {
    if (stream.packets.size() < 3) continue;
    Victim victim(stream);
    victim.receiveUpTo(0);
    EXPECT_EQ(victim.receive(stream.packets[1].bytes), DecodeResult::missingReference);
    victim.receiveUpTo(1);
    EXPECT_EQ(victim.receive(stream.packets[2].bytes), DecodeResult::missingReference);
    victim.expectState(1);
    EXPECT_EQ(victim.receive(stream.packets[1].bytes), DecodeResult::ok);
  }
}

TEST(HostilePacket, StaleIfNotNewer) {
  for (const GoldenStream& stream : readGoldenStreams()) {
    if (stream.packets.size() < 3) continue;
    Victim victim(stream);
    victim.receiveUpTo(2);
    EXPECT_EQ(victim.receive(stream.packets[1].bytes), DecodeResult::stale);
    EXPECT_EQ(victim.receive(stream.packets[0].bytes), DecodeResult::stale);
    victim.expectState(2);
  }
}

TEST(HostilePacket, RefusedIfOfAnotherCodec) {
  const std::vector<GoldenStream> streams = readGoldenStreams();
  std::vector<std::byte> bytes = streams[0].packets[0].bytes;
  for (const std::byte codec : {std::byte{0}, std::byte{1}, std::byte{3}, std::byte{200}}) {
    bytes[1] = codec;
    EXPECT_EQ(Decoder::make(streams[0].layout)->decode(bytes), DecodeResult::malformed);
  }
}

}  // namespace
}  // namespace clothstream::codec
