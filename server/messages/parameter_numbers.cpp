// SPDX-License-Identifier: MIT
// Reads and writes numbers by the field numbers in the tables of parameters.
#include "server/messages/parameter_numbers.h"

#include <algorithm>

#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include "server/model/springs.h"

namespace clothstream::messages {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using parameters::ClothNumber;
using parameters::ClothNumbers;
using parameters::ClothParameter;
using parameters::EnvironmentChange;
using parameters::EnvironmentParameter;
using parameters::EnvironmentValue;
using parameters::kClothParameters;
using parameters::kEnvironmentParameters;
using parameters::WireField;

// Message that a field number belongs to: that of the scene, or that of the change.
using In = std::uint32_t WireField::*;

const FieldDescriptor& fieldOf(const Message& message, std::uint32_t number) {
  return *message.GetDescriptor()->FindFieldByNumber(static_cast<int>(number));
}

bool has(const Message& message, const FieldDescriptor& field) {
  return message.GetReflection()->HasField(message, &field);
}

const Message& groupIn(const Message& message, const FieldDescriptor& field) {
  return message.GetReflection()->GetMessage(message, &field);
}

// Allowed values for this cloth.
Range rangeFor(const ClothParameter& parameter, const model::Cloth& cloth) {
  if (parameter.number != ClothNumber::ballRadius) return parameter.range;
  return {parameter.range.min, double{model::shortestSpring(cloth)}};
}

void checkHasGroup(Checks& checks, const Path& path, const ClothParameter& parameter,
                   std::span<const model::Cloth* const> cloths) {
  for (const model::Cloth* cloth : cloths)
    if (parameters::memberOf(*cloth, parameter.number) == nullptr)
      checks.fail(path, "", fmt::format("must be absent: \"{}\" has none from its start", cloth->name));
}

// `holder` is the message or group that has the field.
void read(Checks& checks, const Path& path, const Message& holder, std::uint32_t number,
          const ClothParameter& parameter, std::span<const model::Cloth* const> cloths,
          ClothNumbers& numbers) {
  const FieldDescriptor& field = fieldOf(holder, number);
  if (field.has_presence() && !has(holder, field)) return;
  const float value = holder.GetReflection()->GetFloat(holder, &field);
  for (const model::Cloth* cloth : cloths)
    checks.number(path / field.json_name(), value, rangeFor(parameter, *cloth));
  numbers[parameter.number] = value;
}

ClothNumbers readAll(Checks& checks, const Path& path, const Message& message, In in,
                     std::span<const model::Cloth* const> cloths) {
  ClothNumbers numbers;
  for (const ClothParameter& parameter : kClothParameters) {
    if (parameter.group == nullptr) {
      read(checks, path, message, parameter.field.*in, parameter, cloths, numbers);
      continue;
    }
    const FieldDescriptor& field = fieldOf(message, parameter.group->field.*in);
    if (!has(message, field)) continue;
    const Path group = path / field.json_name();
    checkHasGroup(checks, group, parameter, cloths);
    if (checks.failed()) continue;
    read(checks, group, groupIn(message, field), parameter.field.*in, parameter, cloths, numbers);
  }
  return numbers;
}

// Field number of a number in the message that has it as a field.
std::uint32_t numberField(const EnvironmentParameter& parameter, std::uint32_t index, In in) {
  return parameter.isMessage() ? index + 1 : parameter.field.*in;
}

EnvironmentChange readEnvironment(Checks& checks, const Path& path, const Message& message, In in) {
  EnvironmentChange change;
  for (const EnvironmentParameter& parameter : kEnvironmentParameters) {
    const FieldDescriptor& field = fieldOf(message, parameter.field.*in);
    if (!has(message, field)) continue;
    const Message* holder = parameter.isMessage() ? &groupIn(message, field) : &message;
    const Path group = parameter.isMessage() ? path / field.json_name() : path;
    const auto* wrapper = dynamic_cast<const v1::Vec3Value*>(holder);
    const Path at = wrapper != nullptr ? group / "value" : group;
    if (wrapper != nullptr) holder = &wrapper->value();
    EnvironmentValue& value = change[parameter.row].emplace(parameters::emptyValue(parameter));
    for (std::uint32_t i = 0; i < parameter.numbers.size(); ++i) {
      const FieldDescriptor& number = fieldOf(*holder, numberField(parameter, i, in));
      if (!number.has_presence() || has(*holder, number))
        value[i] = checks.number(at / number.json_name(), holder->GetReflection()->GetFloat(*holder, &number),
                                 parameter.numbers[i].setting.range);
    }
  }
  return change;
}

}  // namespace

ClothNumbers readNumbers(Checks& checks, const Path& path, const v1::Cloth& message,
                         const model::Cloth& cloth) {
  const model::Cloth* const only[] = {&cloth};
  return readAll(checks, path, message, &WireField::inScene, only);
}

ClothNumbers readNumbers(Checks& checks, const Path& path, const v1::ClothChange& message,
                         std::span<const model::Cloth* const> cloths) {
  return readAll(checks, path, message, &WireField::inChange, cloths);
}

EnvironmentChange readNumbers(Checks& checks, const Path& path, const v1::Environment& message) {
  return readEnvironment(checks, path, message, &WireField::inScene);
}

EnvironmentChange readNumbers(Checks& checks, const Path& path, const v1::ParameterChange& message) {
  return readEnvironment(checks, path, message, &WireField::inChange);
}

bool changesEnvironment(const v1::ParameterChange& message) {
  return std::ranges::any_of(kEnvironmentParameters, [&](const EnvironmentParameter& parameter) {
    return has(message, fieldOf(message, parameter.field.inChange));
  });
}

void writeNumbers(const model::Cloth& cloth, v1::Cloth& message) {
  for (const ClothParameter& parameter : kClothParameters) {
    const float* value = parameters::memberOf(cloth, parameter.number);
    if (value == nullptr) continue;
    Message* holder = &message;
    if (parameter.group != nullptr)
      holder = message.GetReflection()->MutableMessage(&message,
                                                       &fieldOf(message, parameter.group->field.inScene));
    holder->GetReflection()->SetFloat(holder, &fieldOf(*holder, parameter.field.inScene), *value);
  }
}

void writeNumbers(model::Environment environment, v1::Environment& message) {
  for (const EnvironmentParameter& parameter : kEnvironmentParameters) {
    Message* holder = &message;
    if (parameter.isMessage())
      holder = message.GetReflection()->MutableMessage(&message, &fieldOf(message, parameter.field.inScene));
    for (std::uint32_t i = 0; i < parameter.numbers.size(); ++i)
      holder->GetReflection()->SetFloat(holder,
                                        &fieldOf(*holder, numberField(parameter, i, &WireField::inScene)),
                                        model::numberOf(environment, parameter.row, i));
  }
}

void copyNumbers(const v1::Cloth& cloth, v1::ClothChange& change) {
  const auto *from = cloth.GetReflection(), *to = change.GetReflection();
  for (const ClothParameter& parameter : kClothParameters) {
    const WireField& fields = parameter.group != nullptr ? parameter.group->field : parameter.field;
    const FieldDescriptor &source = fieldOf(cloth, fields.inScene),
                          &target = fieldOf(change, fields.inChange);
    if (parameter.group == nullptr)
      to->SetFloat(&change, &target, from->GetFloat(cloth, &source));
    else if (parameter.group->isReplaced || has(cloth, source))
      to->MutableMessage(&change, &target)->CopyFrom(from->GetMessage(cloth, &source));
  }
}

void copyNumbers(const v1::Environment& environment, v1::ParameterChange& change) {
  const auto *from = environment.GetReflection(), *to = change.GetReflection();
  for (const EnvironmentParameter& parameter : kEnvironmentParameters) {
    const FieldDescriptor &source = fieldOf(environment, parameter.field.inScene),
                          &target = fieldOf(change, parameter.field.inChange);
    if (!parameter.isMessage()) {
      to->SetFloat(&change, &target, from->GetFloat(environment, &source));
      continue;
    }
    Message* holder = to->MutableMessage(&change, &target);
    if (auto* wrapper = dynamic_cast<v1::Vec3Value*>(holder)) holder = wrapper->mutable_value();
    holder->CopyFrom(from->GetMessage(environment, &source));
  }
}

}  // namespace clothstream::messages
