// SPDX-License-Identifier: MIT
// Targets of fuzzing: functions that take any bytes and abort if a promise about them is broken.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include <google/protobuf/message.h>

namespace clothstream::fuzz {

struct Target {
  std::string_view name;  // folder of its inputs in tests/fuzz/corpus
  // Handles one input. The working directory is the project's root.
  void (*run)(std::span<const std::byte> input);
  // Message whose text form inputs have. Null: inputs are any bytes.
  const google::protobuf::Message* structure = nullptr;
  // Text that the code under test knows, such as names. Needs a structure; other targets have a dictionary
  // file.
  std::span<const std::string_view> words = {};
};

// All targets that the program is linked with, sorted by name.
std::span<const Target* const> targets();

// Parses the text form of a message. Returns false, and leaves a part of the message, if it is malformed.
[[nodiscard]] bool parseText(std::string_view text, google::protobuf::Message& message);
[[nodiscard]] bool parseText(std::span<const std::byte> text, google::protobuf::Message& message);
// Text form on one line.
std::string toText(const google::protobuf::Message& message);

inline std::string_view textOf(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Aborts with this text if the promise is broken.
void require(bool kept, std::string_view promise);

// Parses the input and handles it, unless it is malformed.
template <typename Input, void (*handle)(const Input&)>
void runStructured(std::span<const std::byte> bytes) {
  Input input;
  if (parseText(bytes, input)) handle(input);
}

}  // namespace clothstream::fuzz
