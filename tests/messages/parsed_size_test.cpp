// SPDX-License-Identifier: MIT
// The bound is at least what the parser needs, and not much more for messages that people send.
#include "server/messages/parsed_size.h"

#include <string>

#include <google/protobuf/unknown_field_set.h>
#include <gtest/gtest.h>

#include "server/messages/scene_file.h"
#include "server/messages/scene_message.h"
#include "tests/messages/scenes.h"

namespace clothstream::messages {
namespace {

constexpr std::size_t kNoLimit = std::size_t{1} << 40;

tl::expected<std::size_t, SizeError> sizeOf(const std::string& bytes, std::size_t limit = kNoLimit) {
  return parsedSize(*v1::Scene::descriptor(), std::as_bytes(std::span(bytes)), limit);
}

std::size_t usedBy(const std::string& bytes) {
  v1::Scene message;
  EXPECT_TRUE(message.ParseFromString(bytes));
  return message.SpaceUsedLong();
}

TEST(ParsedSize, BoundsNamedScenesWithinAFactorOfEight) {
  for (const std::string& name : namedScenes()) {
    const std::string bytes = toMessage(loadScene(name).value()).SerializeAsString();
    const auto bound = sizeOf(bytes);
    ASSERT_TRUE(bound) << name;
    EXPECT_GE(*bound, usedBy(bytes)) << name;
    EXPECT_LE(*bound, 8 * usedBy(bytes)) << name;
  }
}

TEST(ParsedSize, BoundsEveryKindOfSmallElement) {
  v1::Scene pins = smallScene(), vertices = smallScene(), quads = smallScene(), unknown = smallScene(),
            cloths = smallScene(), text = smallScene();
  for (int i = 0; i < 10'000; ++i) {
    pins.mutable_cloths(0)->add_pins();
    vertices.mutable_cloths(0)->add_pinned_vertices(1);
    quads.mutable_cloths(0)->mutable_mesh()->add_quads(1);
    cloths.add_cloths();
    unknown.GetReflection()->MutableUnknownFields(&unknown)->AddVarint(1000, 1);
    unknown.GetReflection()->MutableUnknownFields(&unknown)->AddLengthDelimited(1001)->assign("x");
    unknown.GetReflection()->MutableUnknownFields(&unknown)->AddGroup(1002)->AddVarint(1, 1);
  }
  text.set_description(std::string(10'000, 'x'));
  for (const v1::Scene& message : {pins, vertices, quads, unknown, cloths, text}) {
    const std::string bytes = message.SerializeAsString();
    ASSERT_TRUE(sizeOf(bytes));
    EXPECT_GE(*sizeOf(bytes), usedBy(bytes));
  }
}

TEST(ParsedSize, BoundsFieldsWithAWrongWireType) {
  for (int number = 1; number < 40; ++number)
    for (const std::string& value :
         {std::string("\0\1", 2), std::string("\2\3xyz"), std::string("\1\0\0\0\0\0\0\0\0", 9)}) {
      const auto tag = static_cast<char>(number << 3 | value[0]);
      std::string bytes;
      for (int i = 0; i < 1'000; ++i) {
        bytes += number < 16 ? std::string(1, tag)
                             : std::string{static_cast<char>(tag | 0x80), static_cast<char>(number >> 4)};
        bytes += value.substr(1);
      }
      v1::Scene message;
      if (!message.ParseFromString(bytes)) continue;
      ASSERT_TRUE(sizeOf(bytes)) << number;
      EXPECT_GE(*sizeOf(bytes), message.SpaceUsedLong()) << number << " with wire type " << int{value[0]};
    }
}

// 100 MB of empty pins took 3.9 GB when they were parsed.
TEST(ParsedSize, RefusesAboveTheLimit) {
  v1::Scene message = smallScene();
  for (int i = 0; i < 1'000; ++i) message.mutable_cloths(0)->add_pins();
  const std::string bytes = message.SerializeAsString();
  const std::size_t size = sizeOf(bytes).value();
  EXPECT_GT(size, 40 * bytes.size());
  EXPECT_TRUE(sizeOf(bytes, size));
  EXPECT_EQ(sizeOf(bytes, size - 1).error(), SizeError::tooLarge);
}

TEST(ParsedSize, RefusesWhatTheParserRefuses) {
  const std::string bytes = smallScene().SerializeAsString();
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    const std::string part = bytes.substr(0, length);
    EXPECT_EQ(sizeOf(part).has_value(), v1::Scene().ParseFromString(part)) << length;
  }
  for (const std::string& malformed : {std::string("\x0c"),          // the end of a group that did not start
                                       std::string(2'000, '\x0b')})  // groups in groups
    EXPECT_EQ(sizeOf(malformed).error(), SizeError::malformed);
}

}  // namespace
}  // namespace clothstream::messages
