// SPDX-License-Identifier: MIT
#include "tests/fuzz/mutator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "inputs.pb.h"
#include "tests/fuzz/target.h"

namespace clothstream::fuzz {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

void addFields(const Message& message, std::set<std::string>& fields) {
  std::vector<const FieldDescriptor*> set;
  message.GetReflection()->ListFields(message, &set);
  for (const FieldDescriptor* field : set) {
    fields.insert(field->full_name());
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    const int count = field->is_repeated() ? message.GetReflection()->FieldSize(message, field) : 1;
    for (int i = 0; i < count; ++i)
      addFields(field->is_repeated() ? message.GetReflection()->GetRepeatedMessage(message, field, i)
                                     : message.GetReflection()->GetMessage(message, field),
                fields);
  }
}

v1::Scene twoCloths() {
  v1::Scene scene;
  scene.set_name("scene");
  for (const char* name : {"a", "b"}) {
    v1::Cloth& cloth = *scene.add_cloths();
    cloth.set_name(name);
    cloth.mutable_grid()->set_rows(4);
  }
  return scene;
}

TEST(Mutator, SameSeedGivesSameMessages) {
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    v1::Scene first = twoCloths(), second = twoCloths();
    Mutator(seed).mutate(first);
    Mutator(seed).mutate(second);
    EXPECT_EQ(toText(first), toText(second));
  }
}

TEST(Mutator, DifferentSeedsGiveDifferentMessages) {
  std::set<std::string> texts;
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    v1::Scene scene = twoCloths();
    Mutator(seed).mutate(scene);
    texts.insert(toText(scene));
  }
  EXPECT_GT(texts.size(), 80u);
}

TEST(Mutator, ReachesEveryFieldOfASession) {
  std::set<std::string> fields;
  Mutator mutator(1);
  for (int run = 0; run < 2000; ++run) {
    SessionInput input;
    for (int i = 0; i < 20; ++i) mutator.mutate(input, 20'000);
    addFields(input, fields);
  }
  std::set<std::string> bodies;
  const auto& client = *v1::ClientMessage::descriptor();
  for (int i = 0; i < client.field_count(); ++i) bodies.insert(client.field(i)->full_name());
  const auto& scene = *v1::Scene::descriptor();
  for (int i = 0; i < scene.field_count(); ++i) bodies.insert(scene.field(i)->full_name());
  const auto& cloth = *v1::Cloth::descriptor();
  for (int i = 0; i < cloth.field_count(); ++i) bodies.insert(cloth.field(i)->full_name());
  std::vector<std::string> missed;
  std::ranges::set_difference(bodies, fields, std::back_inserter(missed));
  EXPECT_THAT(missed, testing::IsEmpty());
}

TEST(Mutator, TriesBoundaryValues) {
  std::set<std::uint32_t> rows;
  bool sawNan = false, sawInfinity = false;
  for (std::uint32_t seed = 0; seed < 2000; ++seed) {
    v1::Grid grid;
    grid.set_rows(4);
    grid.set_width(1);
    Mutator(seed).mutate(grid);
    rows.insert(grid.rows());
    sawNan |= std::isnan(grid.width());
    sawInfinity |= std::isinf(grid.width());
  }
  for (const std::uint32_t value : {0u, 1u, 3u, 5u, 0x8000u, 0xffffu, 0xffffffffu, 0x80000000u})
    EXPECT_TRUE(rows.contains(value)) << value;
  EXPECT_TRUE(sawNan);
  EXPECT_TRUE(sawInfinity);
}

TEST(Mutator, UsesWords) {
  constexpr std::array<std::string_view, 1> kWords{"cotton"};
  int used = 0;
  for (std::uint32_t seed = 0; seed < 500; ++seed) {
    v1::Cloth cloth;
    cloth.set_material("silk");
    Mutator(seed, kWords).mutate(cloth);
    used += cloth.material() == "cotton" || cloth.name() == "cotton";
  }
  EXPECT_GT(used, 10);
}

TEST(Mutator, RepeatsElementsManyTimesWithinTheBytes) {
  constexpr std::size_t kMaxBytes = 8192;
  int most = 0;
  for (std::uint32_t seed = 0; seed < 3000; ++seed) {
    v1::Scene scene = twoCloths();
    Mutator(seed).mutate(scene, kMaxBytes);
    most = std::max(most, scene.cloths_size());
    // One value more may pass the limit.
    EXPECT_LT(scene.ByteSizeLong(), 2 * kMaxBytes);
  }
  EXPECT_GT(most, 100);
}

TEST(Mutator, CrossesOverPartsOfBoth) {
  int mixed = 0;
  for (std::uint32_t seed = 0; seed < 100; ++seed) {
    v1::Scene scene = twoCloths(), other = twoCloths();
    other.mutable_cloths(0)->set_name("other");
    Mutator(seed).crossOver(scene, other);
    const std::string text = toText(scene);
    mixed += text.find("other") != text.npos && text.find("\"b\"") != text.npos;
  }
  EXPECT_GT(mixed, 10);
}

TEST(Mutator, TextOfAnyMessageIsReadAgain) {
  Mutator mutator(7);
  for (int run = 0; run < 200; ++run) {
    SceneInput input, again;
    for (int i = 0; i < 10; ++i) mutator.mutate(input, 4096);
    ASSERT_TRUE(parseText(toText(input), again));
    EXPECT_EQ(toText(again), toText(input));
  }
}

TEST(FuzzText, MalformedTextIsRefused) {
  SceneInput input;
  EXPECT_FALSE(parseText("scene {", input));
  EXPECT_FALSE(parseText("no_such_field: 1", input));
  EXPECT_TRUE(parseText("", input));
}

}  // namespace
}  // namespace clothstream::fuzz
