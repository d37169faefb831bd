// SPDX-License-Identifier: MIT
// Messages from clients: each once, in order, in spite of losses.
#include "proto/datagram/input_bundle.h"

#include <array>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/datagram/frames.h"

namespace clothstream::datagram {
namespace {

class Sender {
 public:
  explicit Sender(std::uint32_t first = 0) : sender_(first) {}

  Bytes write(const Bytes& message, std::uint64_t nowUs = 0, bool repeats = true) {
    return cut(sender_.write(message, nowUs, out_, repeats));
  }
  Bytes repeat(std::uint64_t nowUs) { return cut(sender_.repeat(nowUs, out_)); }
  auto repeatUs() const { return sender_.repeatUs(); }

 private:
  Bytes cut(std::size_t bytes) const {
    return {out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(bytes)};
  }

  InputSender sender_;
  std::array<std::byte, kMaxDatagramBytes> out_{};
};

// Messages that the datagram delivers; a message that is refused has one byte, 255.
std::vector<Bytes> received(InputReceiver& receiver, const Bytes& datagram) {
  const auto messages = receiver.receive(datagram);
  if (!messages) return {{std::byte{255}}};
  std::vector<Bytes> copies;
  for (const std::span<const std::byte> message : *messages)
    copies.emplace_back(message.begin(), message.end());
  return copies;
}

Bytes text(int value, std::size_t bytes = 1) {
  return Bytes(bytes, static_cast<std::byte>(value));
}

TEST(InputBundle, HasTheStatedBytes) {
  Sender sender(0x01020304);
  sender.write(text(7));
  EXPECT_EQ(sender.write(text(9, 2)),
            (Bytes{std::byte{2}, std::byte{5}, std::byte{3}, std::byte{2}, std::byte{1}, std::byte{2},
                   std::byte{0}, std::byte{9}, std::byte{9}, std::byte{1}, std::byte{0}, std::byte{7}}));
}

TEST(InputBundle, DeliversEachMessageOnce) {
  // Two of three datagrams are lost, some arrive twice, and numbers continue with 0.
  Sender sender(0xfffffff0);
  InputReceiver receiver;
  const Bytes start = Sender(0x7fffffff).write(text(1));
  EXPECT_EQ(received(receiver, start).size(), 1u) << "numbers may jump";
  std::vector<Bytes> all;
  for (int i = 0; i < 40; ++i) {
    const Bytes datagram = sender.write(text(i));
    if (i % 3 != 2) continue;
    for (const Bytes& message : received(receiver, datagram)) all.push_back(message);
    EXPECT_TRUE(received(receiver, datagram).empty());
  }
  ASSERT_EQ(all.size(), 39u);
  for (int i = 0; i < 39; ++i) EXPECT_EQ(all[static_cast<std::size_t>(i)], text(i));
}

TEST(InputBundle, DropsLateMessages) {
  Sender sender;
  InputReceiver receiver;
  const Bytes first = sender.write(text(0));
  for (int i = 1; i < 4; ++i) sender.write(text(i));
  EXPECT_EQ(received(receiver, sender.write(text(4))), (std::vector<Bytes>{text(2), text(3), text(4)}));
  EXPECT_TRUE(received(receiver, first).empty());
  EXPECT_EQ(received(receiver, sender.write(text(5))), std::vector<Bytes>{text(5)});
}

TEST(InputBundle, RepeatsAsFarAsMessagesFit) {
  Sender sender;
  InputReceiver receiver;
  sender.write(text(0, 500));
  sender.write(text(1, 600));
  EXPECT_EQ(received(receiver, sender.write(text(2, 400))), (std::vector<Bytes>{text(1, 600), text(2, 400)}));
  const Bytes largest = sender.write(text(3, kMaxInputBytes));
  EXPECT_EQ(largest.size(), kMaxDatagramBytes);
  EXPECT_EQ(received(receiver, largest), std::vector<Bytes>{text(3, kMaxInputBytes)});
}

TEST(InputBundle, LastDatagramIsSentThreeTimes) {
  Sender sender;
  EXPECT_FALSE(sender.repeatUs());
  const Bytes datagram = sender.write(text(0), 1'000);
  EXPECT_EQ(sender.repeatUs(), 21'000u);
  EXPECT_EQ(sender.repeat(21'000), datagram);
  EXPECT_EQ(sender.repeatUs(), 41'000u);
  EXPECT_EQ(sender.repeat(41'000), datagram);
  EXPECT_FALSE(sender.repeatUs());
  sender.write(text(1), 50'000);
  EXPECT_EQ(sender.repeatUs(), 70'000u);
}

TEST(InputBundle, RepeatsOnlyWhatAsksForIt) {
  Sender sender;
  sender.write(text(0), 1'000, false);
  EXPECT_FALSE(sender.repeatUs());
  sender.write(text(1), 2'000);
  const Bytes newest = sender.write(text(2), 3'000, false);
  EXPECT_EQ(sender.repeatUs(), 23'000u) << "the message before it is repeated with it";
  EXPECT_EQ(sender.repeat(23'000), newest);
  EXPECT_FALSE(sender.repeatUs());
}

TEST(InputBundle, RefusesOtherLengths) {
  Sender sender;
  sender.write(text(0, 3));
  const Bytes datagram = sender.write(text(1, 2));  // ends after bytes 9 and 14
  for (std::size_t bytes = 0; bytes < datagram.size(); ++bytes) {
    InputReceiver receiver;
    EXPECT_EQ(receiver.receive(std::span(datagram).first(bytes)).has_value(), bytes == 9) << bytes;
  }
  InputReceiver receiver;
  Bytes empty = datagram;
  empty.insert(empty.end(), 2, {});
  EXPECT_FALSE(receiver.receive(empty)) << "an empty message";
  Bytes four = datagram;
  for (int i = 0; i < 2; ++i) four.insert(four.end(), {std::byte{1}, std::byte{0}, std::byte{5}});
  EXPECT_FALSE(receiver.receive(four)) << "four messages";
  EXPECT_EQ(received(receiver, datagram).size(), 2u) << "nothing of refused datagrams was delivered";
}

TEST(InputBundle, DamagedBytesKeepTheOrder) {
  std::mt19937 random(5);
  Sender sender;
  InputReceiver receiver;
  for (int i = 0; i < 2000; ++i) {
    Bytes datagram = sender.write(testMessage(1 + random() % 30));
    datagram[random() % datagram.size()] ^= static_cast<std::byte>(1u << random() % 8);
    if (const auto messages = receiver.receive(datagram)) {
      EXPECT_LE(messages->count, kBundledMessages);
      for (const auto message : *messages) EXPECT_FALSE(message.empty());
    }
  }
}

}  // namespace
}  // namespace clothstream::datagram
