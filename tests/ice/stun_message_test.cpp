// SPDX-License-Identifier: MIT
#include "proto/ice/stun_message.h"

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/ice/sealed_message.h"

namespace clothstream::ice {
namespace {

using Bytes = std::vector<std::byte>;

Bytes fromHex(std::string_view text) {
  Bytes bytes;
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == ' ') {
      ++i;
      continue;
    }
    bytes.push_back(static_cast<std::byte>(std::stoi(std::string(text.substr(i, 2)), nullptr, 16)));
    i += 2;
  }
  return bytes;
}

// RFC 5769, sections 2.1 to 2.3.
constexpr std::string_view kPassword = "VOkJxbRl1RmTxUk/WvJxBt";
constexpr std::string_view kRequest =
    "00010058 2112a442 b7e7a701 bc34d686 fa87dfae 80220010 5354554e 20746573 7420636c 69656e74 00240004"
    "6e0001ff 80290008 932ff9b1 51263b36 00060009 6576746a 3a683676 59202020 00080014 9aeaa70c bfd8cb56"
    "781ef2b5 b2d3f249 c1b571a2 80280004 e57a3bcf";
constexpr std::string_view kIpv4Response =
    "0101003c 2112a442 b7e7a701 bc34d686 fa87dfae 8022000b 74657374 20766563 746f7220 00200008 0001a147"
    "e112a643 00080014 2b91f599 fd9e90c3 8c7489f9 2af9ba53 f06be7d7 80280004 c07d4c96";
constexpr std::string_view kIpv6Response =
    "01010048 2112a442 b7e7a701 bc34d686 fa87dfae 8022000b 74657374 20766563 746f7220 00200014 0002a147"
    "0113a9fa a5d3f179 bc25f4b5 bed2b9d9 00080014 a382954e 4be67bf1 1784c97c 8292c275 bfe3ed41 80280004"
    "c8fb0b4c";

constexpr Address kMappedIpv6{
    .bytes = {0x20, 0x01, 0x0d, 0xb8, 0x12, 0x34, 0x56, 0x78, 0, 0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77},
    .port = 32853};

StunMessage everything() {
  StunMessage message{.kind = StunKind::request,
                      .username = "abcd:efgh1",
                      .priority = 0x6e0001ff,
                      .role = Role::controlling,
                      .tieBreaker = 0x0123456789abcdef,
                      .useCandidate = true,
                      .mapped = kMappedIpv6,
                      .error = 487,
                      .unknown = {0x7fff, 0x0003, 0x0019}};
  message.transaction.fill(std::byte{0x5a});
  return message;
}

TEST(StunMessageTest, ReadsRequestOfRfc5769) {
  const Bytes bytes = fromHex(kRequest);
  const auto message = readStun(bytes);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->kind, StunKind::request);
  EXPECT_EQ(message->username, "evtj:h6vY");
  EXPECT_EQ(message->priority, 0x6e0001ffU);
  EXPECT_EQ(message->role, Role::controlled);
  EXPECT_EQ(message->tieBreaker, 0x932ff9b151263b36U);
  EXPECT_FALSE(message->useCandidate);
  EXPECT_TRUE(message->unknown.empty());
  EXPECT_TRUE(hasIntegrity(*message, bytes, kPassword));
  EXPECT_FALSE(hasIntegrity(*message, bytes, "VOkJxbRl1RmTxUk/WvJxBT"));
  EXPECT_FALSE(hasIntegrity(*message, bytes, ""));
}

TEST(StunMessageTest, ReadsResponsesOfRfc5769) {
  for (const auto& [text, address] :
       {std::pair{kIpv4Response, Address::ofIpv4({192, 0, 2, 1}, 32853)}, {kIpv6Response, kMappedIpv6}}) {
    const Bytes bytes = fromHex(text);
    const auto message = readStun(bytes);
    ASSERT_TRUE(message);
    EXPECT_EQ(message->kind, StunKind::success);
    EXPECT_EQ(message->mapped, address);
    EXPECT_TRUE(hasIntegrity(*message, bytes, kPassword));
  }
}

TEST(StunMessageTest, ReadsWhatItWrites) {
  const StunMessage written = everything();
  const Bytes bytes = writeStun(written, "password");
  const auto read = readStun(bytes);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->kind, written.kind);
  EXPECT_EQ(read->transaction, written.transaction);
  EXPECT_EQ(read->username, written.username);
  EXPECT_EQ(read->priority, written.priority);
  EXPECT_EQ(read->role, written.role);
  EXPECT_EQ(read->tieBreaker, written.tieBreaker);
  EXPECT_TRUE(read->useCandidate);
  EXPECT_EQ(read->mapped, written.mapped);
  EXPECT_EQ(read->error, written.error);
  EXPECT_TRUE(read->unknown.empty()) << "types in UNKNOWN-ATTRIBUTES are not attributes";
  EXPECT_TRUE(hasIntegrity(*read, bytes, "password"));
}

TEST(StunMessageTest, RefusesEveryTruncation) {
  const Bytes whole = writeStun(everything(), "password");
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto exact = std::make_unique<std::byte[]>(size);
    std::copy_n(whole.begin(), size, exact.get());
    EXPECT_FALSE(readStun({exact.get(), size})) << size;
    if (size < 4) continue;
    exact[2] = static_cast<std::byte>((size - 20) >> 8);  // a length that agrees
    exact[3] = static_cast<std::byte>(size - 20);
    EXPECT_FALSE(readStun({exact.get(), size})) << size;
  }
}

TEST(StunMessageTest, RefusesEveryDamagedBit) {
  const Bytes whole = writeStun(everything(), "password");
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    Bytes damaged = whole;
    damaged[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    EXPECT_FALSE(readStun(damaged)) << bit;
  }
}

TEST(StunMessageTest, NeedsFingerprintAtTheEnd) {
  const Bytes whole = fromHex(kRequest);
  Bytes without(whole.begin(), whole.end() - 8);
  without[3] = static_cast<std::byte>(without.size() - 20);
  EXPECT_FALSE(readStun(without));
  const Bytes inside = sealed(StunKind::request, std::span(whole).last(8), kPassword);
  EXPECT_FALSE(readStun(inside)) << "a second one";
}

TEST(StunMessageTest, RefusesWrongLengthsOfAttributes) {
  for (const std::uint16_t type :
       std::initializer_list<std::uint16_t>{0x0006, 0x0008, 0x0009, 0x0020, 0x0024, 0x0025, 0x8029, 0x802A})
    for (const std::size_t size : {0, 1, 3, 4, 5, 7, 8, 9, 19, 20, 21, 100}) {
      Bytes attributes;
      appendAttribute(attributes, type, Bytes(size, type == 0x0009 ? std::byte{3} : std::byte{1}));
      const bool right = type == 0x0006   ? size > 0
                         : type == 0x0008 ? size == 20
                         : type == 0x0009 ? size >= 4
                         : type == 0x0020 ? size == 8
                         : type == 0x0024 ? size == 4
                         : type == 0x0025 ? size == 0
                                          : size == 8;
      EXPECT_EQ(readStun(sealed(StunKind::success, attributes, kPassword)).has_value(), right)
          << type << ", " << size;
    }
  Bytes beyond;
  appendNumber(beyond, 0x8022, 2);
  appendNumber(beyond, 0xffff, 2);
  EXPECT_FALSE(readStun(sealed(StunKind::request, beyond, kPassword)));
}

TEST(StunMessageTest, ListsUnknownAttributesUpToALimit) {
  Bytes attributes;
  appendAttribute(attributes, 0xC057, Bytes(3));  // may be ignored
  for (std::uint16_t type = 0x100; type < 0x120; ++type) appendAttribute(attributes, type, Bytes(1));
  const auto message = readStun(sealed(StunKind::request, attributes, kPassword));
  ASSERT_TRUE(message);
  ASSERT_EQ(message->unknown.size(), StunMessage::kMaxUnknown);
  EXPECT_EQ(message->unknown.front(), 0x100);
}

TEST(StunMessageTest, FirstOfRepeatedAttributesCounts) {
  Bytes attributes;
  appendAttribute(attributes, 0x0024, Bytes(4, std::byte{1}));
  appendAttribute(attributes, 0x0024, Bytes(4, std::byte{2}));
  const auto message = readStun(sealed(StunKind::request, attributes, kPassword));
  ASSERT_TRUE(message);
  EXPECT_EQ(message->priority, 0x01010101U);
}

TEST(StunMessageTest, AttributesAfterIntegrityDoNotCount) {
  const Bytes first = sealed(StunKind::request, {}, kPassword);
  Bytes attributes(first.begin() + 20, first.end() - 8);
  appendAttribute(attributes, 0x0025, Bytes());
  const auto message = readStun(sealed(StunKind::request, attributes, kPassword));
  ASSERT_TRUE(message);
  EXPECT_FALSE(message->useCandidate);
  EXPECT_EQ(message->integrityAt, 20U);
}

TEST(StunMessageTest, RefusesWhatIsTooLong) {
  StunMessage message = everything();
  const std::string name(kMaxUsername, 'a');
  message.username = name;
  EXPECT_TRUE(readStun(writeStun(message, "password")));
  EXPECT_FALSE(readStun(Bytes(kMaxStunBytes + 4)));
  EXPECT_FALSE(readStun(Bytes(65'535)));
}

TEST(StunMessageTest, IsRecognisedByItsFirstByte) {
  EXPECT_TRUE(isStun(fromHex(kRequest)));
  EXPECT_FALSE(isStun({}));
  EXPECT_FALSE(isStun(Bytes{std::byte{20}}));
  EXPECT_FALSE(isStun(Bytes{std::byte{22}}));
}

}  // namespace
}  // namespace clothstream::ice
