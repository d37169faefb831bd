// SPDX-License-Identifier: MIT
// Tables of parameters compared with the messages, the model and the conversion between them.
#include "server/messages/parameter_numbers.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <set>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include "server/messages/client_message.h"
#include "server/messages/scene_message.h"
#include "tests/messages/scenes.h"
#include "tests/model/meshes.h"

namespace clothstream::messages {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using parameters::ClothNumber;
using parameters::ClothParameter;
using parameters::EnvironmentParameter;
using parameters::Group;
using parameters::kClothParameters;
using parameters::kEnvironmentParameters;
using parameters::WireField;

using In = std::uint32_t WireField::*;

// Field of a parameter in Cloth or ClothChange; null if it does not exist.
const FieldDescriptor* fieldOf(const ClothParameter& parameter, const Descriptor* message, In in) {
  if (parameter.group != nullptr) {
    const FieldDescriptor* group = message->FindFieldByNumber(static_cast<int>(parameter.group->field.*in));
    message = group == nullptr ? nullptr : group->message_type();
  }
  return message == nullptr ? nullptr : message->FindFieldByNumber(static_cast<int>(parameter.field.*in));
}

// Names of the fields of `message` that the table does not list.
std::set<std::string> unlisted(const Descriptor* message, In in) {
  std::set<std::string> names;
  for (int i = 0; i < message->field_count(); ++i) {
    const auto number = static_cast<std::uint32_t>(message->field(i)->number());
    const auto lists = [&](const ClothParameter& parameter) {
      return (parameter.group != nullptr ? parameter.group->field : parameter.field).*in == number;
    };
    if (std::ranges::none_of(kClothParameters, lists)) names.insert(std::string(message->field(i)->name()));
  }
  return names;
}

TEST(ParameterTable, HasTheFieldsOfBothMessages) {
  for (const ClothParameter& parameter : kClothParameters)
    for (const auto& [message, in] : {std::pair{v1::Cloth::descriptor(), &WireField::inScene},
                                      std::pair{v1::ClothChange::descriptor(), &WireField::inChange}}) {
      SCOPED_TRACE(fmt::format("--{} in {}", parameter.option, std::string(message->full_name())));
      const FieldDescriptor* field = fieldOf(parameter, message, in);
      ASSERT_NE(field, nullptr);
      EXPECT_EQ(field->name(), parameter.name);
      EXPECT_EQ(field->cpp_type(), FieldDescriptor::CPPTYPE_FLOAT);
      // A number that a change can leave out must be optional.
      EXPECT_EQ(field->has_presence(), parameter.group == nullptr || !parameter.group->isReplaced);
    }
}

TEST(ParameterTable, ListsEveryFieldOfAChangeThatIsANumber) {
  EXPECT_THAT(unlisted(v1::ClothChange::descriptor(), &WireField::inChange),
              testing::UnorderedElementsAre("name", "solver", "material", "areal_mass"));
  EXPECT_THAT(
      unlisted(v1::Cloth::descriptor(), &WireField::inScene),
      testing::UnorderedElementsAre("name", "grid", "mesh", "mass", "areal_mass", "pins", "pinned_vertices",
                                    "pinned_regions", "solver", "attachments", "material", "coarse", "skin"));
  for (const ClothParameter& parameter : kClothParameters) {
    if (parameter.group == nullptr) continue;
    const Descriptor* group = v1::Cloth::descriptor()
                                  ->FindFieldByNumber(static_cast<int>(parameter.group->field.inScene))
                                  ->message_type();
    const auto isInGroup = [&](const ClothParameter& other) { return other.group == parameter.group; };
    int numbers = 0;
    for (int i = 0; i < group->field_count(); ++i)
      numbers += group->field(i)->cpp_type() == FieldDescriptor::CPPTYPE_FLOAT ? 1 : 0;
    EXPECT_EQ(numbers, std::ranges::count_if(kClothParameters, isInGroup)) << parameter.option;
  }
}

TEST(ParameterTable, HasItsRowsInTheOrderOfTheWire) {
  std::uint32_t previous = 0;
  for (const ClothParameter& parameter : kClothParameters) {
    const std::uint32_t group = parameter.group != nullptr ? parameter.group->field.inChange : 0;
    const std::uint32_t place =
        group != 0 ? 1000 * group + parameter.field.inChange : 1000 * parameter.field.inChange;
    EXPECT_GT(place, previous) << parameter.option;
    previous = place;
  }
}

TEST(ParameterTable, SetsTheDefaultsOfTheModel) {
  model::Cloth cloth;
  cloth.selfCollision.emplace();
  cloth.tethers.emplace();
  std::set<const float*> members;
  for (const ClothParameter& parameter : kClothParameters) {
    const float* member = parameters::memberOf(cloth, parameter.number);
    ASSERT_NE(member, nullptr) << parameter.option;
    EXPECT_TRUE(members.insert(member).second) << parameter.option;
    EXPECT_EQ(*member, parameter.initial) << parameter.option;
    // 0 as the radius of a ball means that the server derives it.
    EXPECT_TRUE(parameter.initial == 0 || double{parameter.initial} >= parameter.range.min)
        << parameter.option;
    EXPECT_LE(double{parameter.initial}, parameter.range.max) << parameter.option;
  }
}

TEST(ParameterTable, HasUniqueOptionsWithHelp) {
  std::set<std::string_view> options;
  for (const ClothParameter& parameter : kClothParameters) {
    EXPECT_TRUE(options.insert(parameter.option).second) << parameter.option;
    EXPECT_FALSE(parameter.option.empty() || parameter.optionGroup.empty() || parameter.help.empty());
    EXPECT_LT(parameter.range.min, parameter.range.max) << parameter.option;
  }
}

class EveryNumber : public testing::TestWithParam<ClothParameter> {
 protected:
  EveryNumber() {
    scene_.cloths[0].selfCollision = model::SelfCollision{.radius = 0.01f};
    scene_.cloths[0].tethers.emplace();
    // Only a closed mesh holds gas.
    if (GetParam().number == ClothNumber::pressure)
      scene_.cloths[0].mesh = std::make_shared<const model::Mesh>(model::makeMesh(model::cube(1)));
  }

  // A change of this parameter only.
  v1::ParameterChange changeTo(float value) const {
    v1::ParameterChange change;
    Message* holder = change.add_cloths();
    const auto field = [&](std::uint32_t number) {
      return holder->GetDescriptor()->FindFieldByNumber(static_cast<int>(number));
    };
    if (GetParam().group != nullptr)
      holder = holder->GetReflection()->MutableMessage(holder, field(GetParam().group->field.inChange));
    holder->GetReflection()->SetFloat(holder, field(GetParam().field.inChange), value);
    return change;
  }

  double maximum() const {
    const double shortestSpring = 0.5;
    return GetParam().number == ClothNumber::ballRadius ? shortestSpring : GetParam().range.max;
  }

  // Near the minimum, where the scene is stable.
  float allowed() const {
    const parameters::Range& range = GetParam().range;
    return static_cast<float>(range.min + 1e-4 * (maximum() - range.min));
  }

  model::Scene scene_ = *toScene(smallScene());
};

TEST_P(EveryNumber, ChangesItsMemberOnly) {
  const float value = allowed();
  const auto change = toParameterChange(changeTo(value), scene_, model::StabilityBound(scene_));
  ASSERT_TRUE(change) << change.error().text;
  model::Scene changed = scene_;
  model::applyChange(changed, *change);
  for (const ClothParameter& other : kClothParameters) {
    const float before = *parameters::memberOf(scene_.cloths[0], other.number);
    const Group* group = GetParam().group;
    const bool isReplaced = group != nullptr && group->isReplaced && other.group == group;
    const float expected = other.number == GetParam().number ? value : isReplaced ? 0 : before;
    EXPECT_EQ(*parameters::memberOf(changed.cloths[0], other.number), expected) << other.option;
  }
}

TEST_P(EveryNumber, SurvivesTheSceneMessage) {
  *parameters::memberOf(scene_.cloths[0], GetParam().number) = allowed();
  const auto scene = toScene(toMessage(scene_));
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_EQ(*parameters::memberOf(scene->cloths[0], GetParam().number), allowed());
}

TEST_P(EveryNumber, IsPartOfAChangeThatHoldsAll) {
  model::Scene changed = scene_;
  *parameters::memberOf(changed.cloths[0], GetParam().number) = allowed();
  v1::ParameterChange all;
  copyNumbers(toMessage(changed).cloths(0), *all.add_cloths());
  model::applyChange(scene_, toParameterChange(all, scene_, model::StabilityBound(scene_)).value());
  EXPECT_EQ(*parameters::memberOf(scene_.cloths[0], GetParam().number), allowed());
}

TEST_P(EveryNumber, ChangesTheMessageWithAllParametersLikeTheScene) {
  const v1::ParameterChange message = changeTo(allowed());
  v1::ParameterChange all = allParameters(toMessage(scene_), {});
  applyChange(message, all);
  model::applyChange(scene_, toParameterChange(message, scene_, model::StabilityBound(scene_)).value());
  EXPECT_EQ(all.DebugString(), allParameters(toMessage(scene_), {}).DebugString());
}

TEST_P(EveryNumber, IsRefusedOutsideItsRange) {
  const auto least = static_cast<float>(GetParam().range.min);
  for (const float value : {least - std::max(0.001f, 1e-6f * std::abs(least)),
                            static_cast<float>(maximum()) * 1.01f, std::numeric_limits<float>::quiet_NaN()}) {
    const auto change = toParameterChange(changeTo(value), scene_, model::StabilityBound(scene_));
    ASSERT_FALSE(change) << value;
    EXPECT_THAT(change.error().text,
                testing::HasSubstr(fmt::format(" = {}: must be a finite number from {:g} to ", value,
                                               GetParam().range.min)));
    EXPECT_THAT(change.error().text, testing::StartsWith("parameterChange.cloths[0]."));
  }
}

INSTANTIATE_TEST_SUITE_P(All, EveryNumber, testing::ValuesIn(kClothParameters), [](const auto& instance) {
  std::string name;
  for (const char c : instance.param.option) name += c == '-' ? '_' : c;
  return name;
});

// Fields of `message` that are numbers or messages of numbers.
std::set<std::uint32_t> numberFields(const Descriptor* message) {
  const auto isNumber = [](const FieldDescriptor* field) {
    return field->cpp_type() == FieldDescriptor::CPPTYPE_FLOAT;
  };
  std::set<std::uint32_t> numbers;
  for (int i = 0; i < message->field_count(); ++i) {
    const FieldDescriptor* field = message->field(i);
    const Descriptor* holder = field->message_type();
    if (holder == v1::Vec3Value::descriptor()) holder = v1::Vec3::descriptor();
    bool isOfNumbers = holder != nullptr;
    for (int k = 0; isOfNumbers && k < holder->field_count(); ++k) isOfNumbers = isNumber(holder->field(k));
    if (!field->is_repeated() && (isNumber(field) || isOfNumbers))
      numbers.insert(static_cast<std::uint32_t>(field->number()));
  }
  return numbers;
}

TEST(EnvironmentTable, ListsEveryFieldThatIsANumber) {
  std::set<std::uint32_t> inScene, inChange;
  for (const EnvironmentParameter& parameter : kEnvironmentParameters) {
    inScene.insert(parameter.field.inScene);
    inChange.insert(parameter.field.inChange);
  }
  EXPECT_EQ(numberFields(v1::Environment::descriptor()), inScene);
  EXPECT_EQ(numberFields(v1::ParameterChange::descriptor()), inChange);
}

TEST(EnvironmentTable, HasTheFieldsOfBothMessages) {
  std::size_t index = 0;
  for (const EnvironmentParameter& parameter : kEnvironmentParameters) {
    SCOPED_TRACE(parameter.option);
    EXPECT_EQ(parameter.row, index++);
    const auto* field =
        v1::Environment::descriptor()->FindFieldByNumber(static_cast<int>(parameter.field.inScene));
    const auto* changed =
        v1::ParameterChange::descriptor()->FindFieldByNumber(static_cast<int>(parameter.field.inChange));
    ASSERT_TRUE(field != nullptr && changed != nullptr);
    EXPECT_EQ(field->name(), changed->name());
    EXPECT_TRUE(field->has_presence() && changed->has_presence());
    EXPECT_EQ(changed->message_type(),
              parameter.isVector ? v1::Vec3Value::descriptor() : field->message_type());
    ASSERT_EQ(field->message_type() != nullptr, parameter.isMessage());
    if (!parameter.isMessage()) continue;
    EXPECT_EQ(field->message_type() == v1::Vec3::descriptor(), parameter.isVector);
    ASSERT_EQ(static_cast<std::size_t>(field->message_type()->field_count()), parameter.numbers.size());
    for (std::size_t i = 0; i < parameter.numbers.size(); ++i) {
      const auto* number = field->message_type()->FindFieldByNumber(static_cast<int>(i + 1));
      ASSERT_NE(number, nullptr);
      EXPECT_EQ(number->has_presence(), parameter.numbers[i].isOptional);
    }
  }
}

TEST(EnvironmentTable, SetsTheDefaultsOfTheModel) {
  model::Environment environment;
  std::set<const float*> members;
  for (const EnvironmentParameter& parameter : kEnvironmentParameters)
    for (std::uint32_t i = 0; i < parameter.numbers.size(); ++i) {
      const float& member = model::numberOf(environment, parameter.row, i);
      EXPECT_TRUE(members.insert(&member).second) << parameter.option;
      EXPECT_EQ(member, initial(parameter.row, i)) << parameter.option;
    }
}

}  // namespace
}  // namespace clothstream::messages
