// SPDX-License-Identifier: MIT
// Reads and writes the numbers of a cloth by the field numbers in the table of parameters.
#include "server/messages/cloth_numbers.h"

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
using parameters::kClothParameters;
using parameters::WireField;

// Message that a field number belongs to: Cloth or ClothChange.
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

}  // namespace

ClothNumbers readNumbers(Checks& checks, const Path& path, const v1::Cloth& message,
                         const model::Cloth& cloth) {
  const model::Cloth* const only[] = {&cloth};
  return readAll(checks, path, message, &WireField::inCloth, only);
}

ClothNumbers readNumbers(Checks& checks, const Path& path, const v1::ClothChange& message,
                         std::span<const model::Cloth* const> cloths) {
  return readAll(checks, path, message, &WireField::inChange, cloths);
}

void writeNumbers(const model::Cloth& cloth, v1::Cloth& message) {
  for (const ClothParameter& parameter : kClothParameters) {
    const float* value = parameters::memberOf(cloth, parameter.number);
    if (value == nullptr) continue;
    Message* holder = &message;
    if (parameter.group != nullptr)
      holder = message.GetReflection()->MutableMessage(&message,
                                                       &fieldOf(message, parameter.group->field.inCloth));
    holder->GetReflection()->SetFloat(holder, &fieldOf(*holder, parameter.field.inCloth), *value);
  }
}

void copyNumbers(const v1::Cloth& cloth, v1::ClothChange& change) {
  const auto *from = cloth.GetReflection(), *to = change.GetReflection();
  for (const ClothParameter& parameter : kClothParameters) {
    const WireField& fields = parameter.group != nullptr ? parameter.group->field : parameter.field;
    const FieldDescriptor &source = fieldOf(cloth, fields.inCloth),
                          &target = fieldOf(change, fields.inChange);
    if (parameter.group == nullptr)
      to->SetFloat(&change, &target, from->GetFloat(cloth, &source));
    else if (parameter.group->isReplaced || has(cloth, source))
      to->MutableMessage(&change, &target)->CopyFrom(from->GetMessage(cloth, &source));
  }
}

}  // namespace clothstream::messages
