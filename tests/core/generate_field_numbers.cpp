// SPDX-License-Identifier: MIT
// Writes clients/core/wire/field_numbers.h from the descriptors of scene.proto, session.proto and
// recording.proto.
// Usage: generate_field_numbers [--check] FILE. With --check it writes nothing, and fails if FILE is out of
// date.
#include <cctype>
#include <cstdlib>
#include <iostream>
#include <string>
#include <string_view>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/wire_format_lite.h>

#include "clothstream/v1/recording.pb.h"
#include "clothstream/v1/session.pb.h"
#include "tests/core/generated_file.h"

namespace {

using google::protobuf::Descriptor;
using google::protobuf::EnumDescriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::FileDescriptor;
using google::protobuf::internal::WireFormatLite;

// "some_name" and "SOME_NAME" become "SomeName".
std::string pascalCase(std::string_view name) {
  std::string out;
  bool startsWord = true;
  for (const char letter : name) {
    if (letter == '_') {
      startsWord = true;
      continue;
    }
    const auto code = static_cast<unsigned char>(letter);
    out += static_cast<char>(startsWord ? std::toupper(code) : std::tolower(code));
    startsWord = false;
  }
  return out;
}

// "GrabEventKind" becomes "GRAB_EVENT_KIND_", the prefix of its values.
std::string valuePrefix(std::string_view enumName) {
  std::string out;
  for (const char letter : enumName) {
    const auto code = static_cast<unsigned char>(letter);
    if (std::isupper(code) && !out.empty()) out += '_';
    out += static_cast<char>(std::toupper(code));
  }
  return out + '_';
}

// Name of the WireType enumerator in wire.h.
std::string wireType(const FieldDescriptor& field) {
  if (field.is_packed()) return "kBytes";
  const auto type = static_cast<WireFormatLite::FieldType>(field.type());
  switch (WireFormatLite::WireTypeForFieldType(type)) {
    case WireFormatLite::WIRETYPE_VARINT:
      return "kVarint";
    case WireFormatLite::WIRETYPE_FIXED64:
      return "kFixed64";
    case WireFormatLite::WIRETYPE_FIXED32:
      return "kFixed32";
    case WireFormatLite::WIRETYPE_LENGTH_DELIMITED:
      return "kBytes";
    default:
      std::cerr << "generate_field_numbers: " << field.full_name()
                << " has a wire type that is not supported\n";
      std::exit(1);
  }
}

std::string messageText(const Descriptor& message) {
  if (message.nested_type_count() + message.enum_type_count() > 0) {
    std::cerr << "generate_field_numbers: " << message.full_name()
              << " has nested types, which are not supported\n";
    std::exit(1);
  }
  if (message.field_count() == 0) return {};
  std::string out = "struct " + std::string(message.name()) + " {\n";
  for (int i = 0; i < message.field_count(); ++i) {
    const FieldDescriptor& field = *message.field(i);
    out += "  static constexpr Field k" + pascalCase(field.name()) + "{" + std::to_string(field.number()) +
           ", WireType::" + wireType(field) + "};\n";
  }
  return out + "};\n";
}

std::string enumText(const EnumDescriptor& values) {
  const std::string prefix = valuePrefix(values.name());
  std::string out = "struct " + std::string(values.name()) + " {\n";
  for (int i = 0; i < values.value_count(); ++i) {
    std::string name(values.value(i)->name());
    if (name.starts_with(prefix)) name.erase(0, prefix.size());
    out += "  static constexpr std::uint32_t k" + pascalCase(name) + " = " +
           std::to_string(values.value(i)->number()) + ";\n";
  }
  return out + "};\n";
}

std::string fileText(const FileDescriptor& file) {
  std::string out = "\n// " + std::string(file.name()) + "\n";
  for (int i = 0; i < file.enum_type_count(); ++i) out += enumText(*file.enum_type(i));
  for (int i = 0; i < file.message_type_count(); ++i) out += messageText(*file.message_type(i));
  return out;
}

std::string header() {
  const FileDescriptor& session = *clothstream::v1::ServerMessage::descriptor()->file();
  std::string out =
      "// SPDX-License-Identifier: MIT\n"
      "// Field numbers, wire types and enum values of the protocol. Generated from the .proto files by\n"
      "// tests/core/generate_field_numbers.cpp. Do not edit.\n"
      "#pragma once\n\n"
      "// clang-format off\n"
      "#include <cstdint>\n\n"
      "namespace clothstream::client::field {\n\n"
      "enum class WireType : std::uint32_t { kVarint = 0, kFixed64 = 1, kBytes = 2, kFixed32 = 5 };\n\n"
      "// `number` writes the field. `tag` recognises it: number and wire type as they stand on the wire.\n"
      "struct Field {\n"
      "  std::uint32_t number, tag;\n"
      "  constexpr Field(std::uint32_t fieldNumber, WireType type)\n"
      "      : number(fieldNumber), tag(fieldNumber << 3 | static_cast<std::uint32_t>(type)) {}\n"
      "};\n";
  for (int i = 0; i < session.dependency_count(); ++i) out += fileText(*session.dependency(i));
  out += fileText(session);
  out += fileText(*clothstream::v1::RecordedTick::descriptor()->file());
  return out + "\n}  // namespace clothstream::client::field\n";
}

}  // namespace

int main(int count, char** arguments) {
  return clothstream::writeOrCheck(count, arguments, "generate_field_numbers", &header);
}
