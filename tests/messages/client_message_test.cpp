// SPDX-License-Identifier: MIT
// Messages of clients: invalid bytes, envelopes, join requests.
#include "server/messages/client_message.h"

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/limits.h"

namespace clothstream::messages {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

std::span<const std::byte> bytesOf(const std::string& text) {
  return std::as_bytes(std::span(text));
}

TEST(ParseClientMessage, ReturnsTheEnvelope) {
  v1::ClientMessage message;
  message.set_request_id(7);
  message.mutable_ping()->set_client_time_us(123);
  const auto parsed = parseClientMessage(bytesOf(message.SerializeAsString()));
  ASSERT_TRUE(parsed) << parsed.error().text;
  EXPECT_EQ(parsed->request_id(), 7u);
  EXPECT_EQ(parsed->ping().client_time_us(), 123u);
}

TEST(ParseClientMessage, RefusesEmptyBytesAndAnEmptyEnvelope) {
  EXPECT_EQ(parseClientMessage({}).error().code, v1::ERROR_CODE_MALFORMED_MESSAGE);
  v1::ClientMessage message;
  message.set_request_id(7);
  EXPECT_EQ(parseClientMessage(bytesOf(message.SerializeAsString())).error().code,
            v1::ERROR_CODE_MALFORMED_MESSAGE);
}

TEST(ParseClientMessage, RefusesTooManyBytesAndNamesTheLimit) {
  const auto parsed = parseClientMessage(bytesOf(std::string(limits::kMaxClientMessageBytes + 1, 'x')));
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.error().code, v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(parsed.error().text, HasSubstr("at most 65536"));
}

TEST(ParseClientMessage, RefusesTruncatedMessages) {
  v1::ClientMessage message;
  message.mutable_hello()->set_scene("curtain");
  const std::string whole = message.SerializeAsString();
  for (std::size_t length = 1; length < whole.size(); ++length) {
    const auto parsed = parseClientMessage(bytesOf(whole.substr(0, length)));
    ASSERT_FALSE(parsed) << length;
    EXPECT_EQ(parsed.error().code, v1::ERROR_CODE_MALFORMED_MESSAGE);
  }
}

TEST(ParseClientMessage, SurvivesRandomBytes) {
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 10000; ++i) {
    std::string garbage(random() % 200, '\0');
    for (char& c : garbage) c = static_cast<char>(random());
    const auto parsed = parseClientMessage(bytesOf(garbage));
    if (!parsed) ++refused;
  }
  EXPECT_GT(refused, 9000);
}

const std::uint32_t kCodecs[] = {1, 5};

v1::Hello hello() {
  v1::Hello message;
  message.set_protocol_version(1);
  message.add_codecs(1);
  return message;
}

TEST(ToJoining, ReadsQuality) {
  v1::Hello message = hello();
  auto joining = toJoining(message, kCodecs);
  ASSERT_TRUE(joining);
  EXPECT_EQ(joining->quality, 0);
  message.set_quality(3);
  joining = toJoining(message, kCodecs);
  ASSERT_TRUE(joining);
  EXPECT_EQ(joining->quality, 3);
  message.set_quality(4);
  EXPECT_THAT(toJoining(message, kCodecs).error().text, StartsWith("hello.quality = 4: must be"));
}

TEST(ToJoining, SelectsVersionAndFirstCommonCodec) {
  v1::Hello message = hello();
  message.set_protocol_version(9);
  message.clear_codecs();
  for (const std::uint32_t codec : {8u, 5u, 1u}) message.add_codecs(codec);
  message.set_scene("flag");
  message.set_client_name("test 1");
  message.set_display_name("Ann");
  const auto joining = toJoining(message, kCodecs);
  ASSERT_TRUE(joining) << joining.error().text;
  EXPECT_EQ(joining->protocolVersion, kProtocolVersion);
  EXPECT_EQ(joining->codec, 5u);
  EXPECT_EQ(joining->scene, "flag");
  EXPECT_EQ(joining->clientName, "test 1");
  EXPECT_EQ(joining->displayName, "Ann");
}

TEST(ToJoining, RefusesUnsupportedVersionsAndCodecs) {
  v1::Hello message = hello();
  message.set_protocol_version(0);
  EXPECT_EQ(toJoining(message, kCodecs).error().code, v1::ERROR_CODE_UNSUPPORTED_VERSION);
  message = hello();
  message.set_codecs(0, 77);
  const auto joining = toJoining(message, kCodecs);
  EXPECT_EQ(joining.error().code, v1::ERROR_CODE_UNSUPPORTED_CODEC);
  EXPECT_THAT(joining.error().text, HasSubstr("update the client"));
  EXPECT_THAT(joining.error().text, HasSubstr("1, 5"));
  message.clear_codecs();
  EXPECT_EQ(toJoining(message, kCodecs).error().code, v1::ERROR_CODE_UNSUPPORTED_CODEC);
}

TEST(ToJoining, RefusesNamesWithControlCharacters) {
  v1::Hello message = hello();
  message.set_client_name("a\nb");
  EXPECT_THAT(toJoining(message, kCodecs).error().text, StartsWith("hello.clientName = \"a?b\":"));
  message = hello();
  message.set_display_name(std::string(2000, 'x'));
  EXPECT_THAT(toJoining(message, kCodecs).error().text, StartsWith("hello.displayName"));
  message = hello();
  message.set_scene("../etc");
  EXPECT_THAT(toJoining(message, kCodecs).error().text, StartsWith("hello.scene = \"../etc\":"));
}

// Names that look like "Ann Lee" are "Ann Lee".
TEST(ToJoining, NamesAreWhatPeopleSee) {
  for (const char* name :
       {"Ann Lee", "A\u200bnn Lee", "Ann Lee\u2060", "\ufeffAnn Lee", "Ann\u00a0Lee",
        "\u3164 Ann \u200d\u2003 Lee ", "Ann\u00ad Lee\ufe0f", "\U000e0041Ann Lee\u2800"}) {
    v1::Hello message = hello();
    message.set_display_name(name);
    message.set_client_name(name);
    const auto joining = toJoining(message, kCodecs);
    ASSERT_TRUE(joining) << joining.error().text;
    EXPECT_EQ(joining->displayName, "Ann Lee");
    EXPECT_EQ(joining->clientName, "Ann Lee");
  }
}

TEST(ToJoining, NamesKeepPicturesAndLettersOfAllScripts) {
  // A woman with a laptop, a heart, and names with combining and right-to-left letters.
  for (const char* name : {"\U0001f469\u200d\U0001f4bb", "\u2764 Bo", "Zo\u0065\u0308", "\u05d3\u05d5\u05d3",
                           "\u0928\u092e\u0938\u094d\u0924\u0947", "\u5f20\u4f1f"}) {
    v1::Hello message = hello();
    message.set_display_name(name);
    EXPECT_EQ(toJoining(message, kCodecs)->displayName, name);
  }
  v1::Hello message = hello();
  message.set_display_name("\u2764\u200dBo\ufe0f");  // a joiner and a style without a picture
  EXPECT_EQ(toJoining(message, kCodecs)->displayName, "\u2764Bo");
  message.set_display_name("\u200b\u2800 \u3164");
  EXPECT_EQ(toJoining(message, kCodecs)->displayName, "");
}

}  // namespace
}  // namespace clothstream::messages
