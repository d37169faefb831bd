// SPDX-License-Identifier: MIT
#include "tests/fuzz/mutator.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <google/protobuf/descriptor.h>

namespace clothstream::fuzz {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr int kMaxDepth = 12;

void collect(Message& message, std::vector<Message*>& all, int depth = 0) {
  all.push_back(&message);
  if (depth >= kMaxDepth) return;
  const Reflection& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated()) {
      collect(*reflection.MutableMessage(&message, field), all, depth + 1);
      continue;
    }
    for (int i = 0; i < reflection.FieldSize(message, field); ++i)
      collect(*reflection.MutableRepeatedMessage(&message, field, i), all, depth + 1);
  }
}

// All messages of this type in the tree.
void collectOf(const Message& message, const Descriptor* type, std::vector<const Message*>& all,
               int depth = 0) {
  if (message.GetDescriptor() == type) all.push_back(&message);
  if (depth >= kMaxDepth) return;
  const Reflection& reflection = *message.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection.ListFields(message, &fields);
  for (const FieldDescriptor* field : fields) {
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
    if (!field->is_repeated()) {
      collectOf(reflection.GetMessage(message, field), type, all, depth + 1);
      continue;
    }
    for (int i = 0; i < reflection.FieldSize(message, field); ++i)
      collectOf(reflection.GetRepeatedMessage(message, field, i), type, all, depth + 1);
  }
}

void addElement(Message& message, const FieldDescriptor* field) {
  const Reflection& reflection = *message.GetReflection();
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return reflection.AddInt32(&message, field, 0);
    case FieldDescriptor::CPPTYPE_INT64:
      return reflection.AddInt64(&message, field, 0);
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection.AddUInt32(&message, field, 0);
    case FieldDescriptor::CPPTYPE_UINT64:
      return reflection.AddUInt64(&message, field, 0);
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return reflection.AddDouble(&message, field, 0);
    case FieldDescriptor::CPPTYPE_FLOAT:
      return reflection.AddFloat(&message, field, 0);
    case FieldDescriptor::CPPTYPE_BOOL:
      return reflection.AddBool(&message, field, false);
    case FieldDescriptor::CPPTYPE_ENUM:
      return reflection.AddEnumValue(&message, field, 0);
    case FieldDescriptor::CPPTYPE_STRING:
      return reflection.AddString(&message, field, {});
    case FieldDescriptor::CPPTYPE_MESSAGE:
      reflection.AddMessage(&message, field);
  }
}

// Copies element `index` to the end.
void repeatElement(Message& message, const FieldDescriptor* field, int index) {
  const Reflection& reflection = *message.GetReflection();
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return reflection.AddInt32(&message, field, reflection.GetRepeatedInt32(message, field, index));
    case FieldDescriptor::CPPTYPE_INT64:
      return reflection.AddInt64(&message, field, reflection.GetRepeatedInt64(message, field, index));
    case FieldDescriptor::CPPTYPE_UINT32:
      return reflection.AddUInt32(&message, field, reflection.GetRepeatedUInt32(message, field, index));
    case FieldDescriptor::CPPTYPE_UINT64:
      return reflection.AddUInt64(&message, field, reflection.GetRepeatedUInt64(message, field, index));
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return reflection.AddDouble(&message, field, reflection.GetRepeatedDouble(message, field, index));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return reflection.AddFloat(&message, field, reflection.GetRepeatedFloat(message, field, index));
    case FieldDescriptor::CPPTYPE_BOOL:
      return reflection.AddBool(&message, field, reflection.GetRepeatedBool(message, field, index));
    case FieldDescriptor::CPPTYPE_ENUM:
      return reflection.AddEnumValue(&message, field, reflection.GetRepeatedEnumValue(message, field, index));
    case FieldDescriptor::CPPTYPE_STRING:
      return reflection.AddString(&message, field, reflection.GetRepeatedString(message, field, index));
    case FieldDescriptor::CPPTYPE_MESSAGE: {
      Message& added = *reflection.AddMessage(&message, field);
      added.CopyFrom(reflection.GetRepeatedMessage(message, field, index));
    }
  }
}

}  // namespace

void Mutator::mutate(Message& message, std::size_t maxBytes) {
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
    const std::size_t bytes = message.ByteSizeLong();
    change(message, bytes < maxBytes ? maxBytes - bytes : 0);
  }
}

void Mutator::change(Message& root, std::size_t room) {
  std::vector<Message*> all;
  collect(root, all);
  Message& message = *all[below(all.size())];
  const Descriptor& type = *message.GetDescriptor();
  if (type.field_count() == 0) return;
  // Half of the changes are in fields that the message has.
  std::vector<const FieldDescriptor*> fields;
  message.GetReflection()->ListFields(message, &fields);
  const FieldDescriptor* field =
      !fields.empty() && oneIn(2)
          ? fields[below(fields.size())]
          : type.field(static_cast<int>(below(static_cast<std::size_t>(type.field_count()))));
  if (field->is_repeated()) return changeRepeated(message, field, root, room);
  if (message.GetReflection()->HasField(message, field) && oneIn(8))
    return message.GetReflection()->ClearField(&message, field);
  setField(message, field, root);
}

void Mutator::setField(Message& message, const FieldDescriptor* field, const Message& root) {
  const Reflection& reflection = *message.GetReflection();
  if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) return setValue(message, field, -1);
  std::vector<const Message*> others;
  collectOf(root, field->message_type(), others);
  if (!others.empty() && oneIn(2)) {
    // The copy is made first, because the source may contain the destination.
    const std::unique_ptr<Message> copy(others[below(others.size())]->New());
    copy->CopyFrom(*others[below(others.size())]);
    reflection.MutableMessage(&message, field)->CopyFrom(*copy);
  } else {
    fill(*reflection.MutableMessage(&message, field), 0);
  }
}

// Sets some fields, so that an added message is not empty.
void Mutator::fill(Message& message, int depth) {
  const Descriptor& type = *message.GetDescriptor();
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor* field = type.field(i);
    if (!oneIn(2 + static_cast<std::size_t>(depth))) continue;
    if (field->is_repeated()) addElement(message, field);
    if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) {
      setValue(message, field, field->is_repeated() ? 0 : -1);
    } else if (depth < 3) {
      fill(field->is_repeated() ? *message.GetReflection()->MutableRepeatedMessage(&message, field, 0)
                                : *message.GetReflection()->MutableMessage(&message, field),
           depth + 1);
    }
  }
}

void Mutator::changeRepeated(Message& message, const FieldDescriptor* field, const Message& root,
                             std::size_t room) {
  const Reflection& reflection = *message.GetReflection();
  const int size = reflection.FieldSize(message, field);
  const auto any = [&] { return static_cast<int>(below(static_cast<std::size_t>(size))); };
  const std::size_t choice = size == 0 ? 0 : below(8);
  switch (choice) {
    case 0: {
      if (room == 0) return;
      addElement(message, field);
      const bool isMessage = field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE;
      if (isMessage)
        fill(*reflection.MutableRepeatedMessage(&message, field, size), 0);
      else
        setValue(message, field, size);
      if (size > 0) reflection.SwapElements(&message, field, size, any());
      return;
    }
    case 1:
      reflection.SwapElements(&message, field, any(), size - 1);
      return reflection.RemoveLast(&message, field);
    case 2:
      return reflection.SwapElements(&message, field, any(), any());
    case 3: {
      // Many copies find costs that grow faster than the input.
      const int index = any();
      const std::size_t element =
          std::max<std::size_t>(1, message.ByteSizeLong() / static_cast<std::size_t>(size));
      const std::size_t most = oneIn(8) ? std::size_t{1} << below(13) : 1 + below(4);
      const std::size_t copies = std::min(most, room / element);
      for (std::size_t i = 0; i < copies; ++i) repeatElement(message, field, index);
      return;
    }
    case 4:
      while (reflection.FieldSize(message, field) > size / 2) reflection.RemoveLast(&message, field);
      return;
    default:
      if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
        std::vector<const Message*> others;
        collectOf(root, field->message_type(), others);
        const std::unique_ptr<Message> copy(others[below(others.size())]->New());
        copy->CopyFrom(*others[below(others.size())]);
        reflection.MutableRepeatedMessage(&message, field, any())->CopyFrom(*copy);
      } else {
        setValue(message, field, any());
      }
  }
}

void Mutator::setValue(Message& message, const FieldDescriptor* field, int index) {
  const Reflection& reflection = *message.GetReflection();
  const bool repeated = index >= 0;
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32: {
      const auto value = wholeNumber(repeated ? reflection.GetRepeatedInt32(message, field, index)
                                              : reflection.GetInt32(message, field));
      return repeated ? reflection.SetRepeatedInt32(&message, field, index, value)
                      : reflection.SetInt32(&message, field, value);
    }
    case FieldDescriptor::CPPTYPE_INT64: {
      const auto value = wholeNumber(repeated ? reflection.GetRepeatedInt64(message, field, index)
                                              : reflection.GetInt64(message, field));
      return repeated ? reflection.SetRepeatedInt64(&message, field, index, value)
                      : reflection.SetInt64(&message, field, value);
    }
    case FieldDescriptor::CPPTYPE_UINT32: {
      const auto value = wholeNumber(repeated ? reflection.GetRepeatedUInt32(message, field, index)
                                              : reflection.GetUInt32(message, field));
      return repeated ? reflection.SetRepeatedUInt32(&message, field, index, value)
                      : reflection.SetUInt32(&message, field, value);
    }
    case FieldDescriptor::CPPTYPE_UINT64: {
      const auto value = wholeNumber(repeated ? reflection.GetRepeatedUInt64(message, field, index)
                                              : reflection.GetUInt64(message, field));
      return repeated ? reflection.SetRepeatedUInt64(&message, field, index, value)
                      : reflection.SetUInt64(&message, field, value);
    }
    case FieldDescriptor::CPPTYPE_FLOAT: {
      const auto value = realNumber(repeated ? reflection.GetRepeatedFloat(message, field, index)
                                             : reflection.GetFloat(message, field));
      return repeated ? reflection.SetRepeatedFloat(&message, field, index, value)
                      : reflection.SetFloat(&message, field, value);
    }
    case FieldDescriptor::CPPTYPE_DOUBLE: {
      const auto value = realNumber(repeated ? reflection.GetRepeatedDouble(message, field, index)
                                             : reflection.GetDouble(message, field));
      return repeated ? reflection.SetRepeatedDouble(&message, field, index, value)
                      : reflection.SetDouble(&message, field, value);
    }
    case FieldDescriptor::CPPTYPE_BOOL: {
      const bool value = oneIn(2);
      return repeated ? reflection.SetRepeatedBool(&message, field, index, value)
                      : reflection.SetBool(&message, field, value);
    }
    case FieldDescriptor::CPPTYPE_ENUM: {
      const auto& values = *field->enum_type();
      const int value =
          oneIn(8) ? wholeNumber(0)
                   : values.value(static_cast<int>(below(static_cast<std::size_t>(values.value_count()))))
                         ->number();
      return repeated ? reflection.SetRepeatedEnumValue(&message, field, index, value)
                      : reflection.SetEnumValue(&message, field, value);
    }
    case FieldDescriptor::CPPTYPE_STRING: {
      std::string value = repeated ? reflection.GetRepeatedString(message, field, index)
                                   : reflection.GetString(message, field);
      field->type() == FieldDescriptor::TYPE_BYTES ? changeBytes(value) : changeText(value);
      return repeated ? reflection.SetRepeatedString(&message, field, index, std::move(value))
                      : reflection.SetString(&message, field, std::move(value));
    }
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return;
  }
}

template <typename Number>
Number Mutator::wholeNumber(Number present) {
  using Limits = std::numeric_limits<Number>;
  using Unsigned = std::make_unsigned_t<Number>;
  switch (below(6)) {
    case 0:
      return static_cast<Number>(below(16));
    case 1: {
      constexpr std::array kBounds{Limits::min(), Limits::max(), Number{0}, Number{1}};
      return kBounds[below(kBounds.size())];
    }
    case 2: {
      // Near a power of two.
      const auto power = static_cast<Unsigned>(Unsigned{1} << below(Limits::digits));
      return static_cast<Number>(power + static_cast<Unsigned>(below(3)) - 1);
    }
    case 3:
      return static_cast<Number>(static_cast<Unsigned>(present) + static_cast<Unsigned>(below(3)) - 1);
    case 4:
      return static_cast<Number>(below(100'000));
    default:
      return static_cast<Number>(static_cast<Unsigned>(present) ^
                                 static_cast<Unsigned>(Unsigned{1} << below(Limits::digits)));
  }
}

template <typename Number>
Number Mutator::realNumber(Number present) {
  using Limits = std::numeric_limits<Number>;
  switch (below(6)) {
    case 0: {
      constexpr std::array kBounds{Number{0},           -Number{0},           Number{1},
                                   -Number{1},          Limits::infinity(),   -Limits::infinity(),
                                   Limits::quiet_NaN(), Limits::max(),        Limits::lowest(),
                                   Limits::min(),       Limits::denorm_min(), Limits::epsilon()};
      return kBounds[below(kBounds.size())];
    }
    case 1:
      return std::ldexp(Number{1}, static_cast<int>(below(64)) - 40);
    case 2:
      return std::pow(Number{10}, static_cast<Number>(static_cast<int>(below(16)) - 8));
    case 3:
      return std::nextafter(present, oneIn(2) ? Limits::infinity() : -Limits::infinity());
    case 4:
      return static_cast<Number>(static_cast<int>(below(2001)) - 1000) / 100;
    default:
      return oneIn(2) ? -present : present * static_cast<Number>(below(8));
  }
}

void Mutator::changeText(std::string& text) {
  if (!words_.empty() && !oneIn(3)) {
    text = words_[below(words_.size())];
    return;
  }
  changeBytes(text);
}

void Mutator::changeBytes(std::string& bytes) {
  if (changeBytes_ && !oneIn(4)) return changeBytes_(bytes);
  const std::size_t at = bytes.empty() ? 0 : below(bytes.size());
  const std::size_t length = bytes.empty() ? 0 : std::min(bytes.size() - at, 1 + below(8));
  switch (bytes.empty() ? 0 : below(6)) {
    case 0:
      bytes.insert(at, 1 + below(8), static_cast<char>(below(256)));
      return;
    case 1:
      bytes.erase(at, length);
      return;
    case 2:
      bytes[at] = static_cast<char>(below(256));
      return;
    case 3:
      bytes[at] = static_cast<char>(static_cast<std::uint8_t>(bytes[at]) ^ (1u << below(8)));
      return;
    case 4:
      std::fill_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), length, oneIn(2) ? '\0' : '\xff');
      return;
    default:
      bytes.append(bytes, at, length);
  }
}

void Mutator::crossOver(Message& message, const Message& other) {
  std::vector<Message*> all;
  collect(message, all);
  Message& destination = *all[below(all.size())];
  std::vector<const Message*> sources;
  collectOf(other, destination.GetDescriptor(), sources);
  if (sources.empty()) return;
  const Message& source = *sources[below(sources.size())];
  // Repeated fields of both are kept one time in two: the steps of one input follow those of the other.
  oneIn(2) ? destination.MergeFrom(source) : destination.CopyFrom(source);
}

}  // namespace clothstream::fuzz
