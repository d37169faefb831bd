// SPDX-License-Identifier: MIT
#include "tests/fuzz/target.h"

#include <cstdio>
#include <cstdlib>

#include <google/protobuf/io/tokenizer.h>
#include <google/protobuf/stubs/logging.h>
#include <google/protobuf/text_format.h>

namespace clothstream::fuzz {
namespace {

class Silent final : public google::protobuf::io::ErrorCollector {
 public:
  void AddError(int, google::protobuf::io::ColumnNumber, const std::string&) override {}
};

}  // namespace

bool parseText(std::string_view text, google::protobuf::Message& message) {
  static const auto loud = google::protobuf::SetLogHandler(nullptr);  // texts that are not UTF-8
  static_cast<void>(loud);
  google::protobuf::TextFormat::Parser parser;
  Silent errors;
  parser.RecordErrorsTo(&errors);
  parser.SetRecursionLimit(100);
  return parser.ParseFromString(std::string(text), &message);
}

bool parseText(std::span<const std::byte> text, google::protobuf::Message& message) {
  return parseText(textOf(text), message);
}

std::string toText(const google::protobuf::Message& message) {
  std::string text;
  google::protobuf::TextFormat::Printer printer;
  printer.SetSingleLineMode(true);
  printer.PrintToString(message, &text);
  return text;
}

void require(bool kept, std::string_view promise) {
  if (kept) return;
  std::fprintf(stderr, "a promise is broken: %.*s\n", static_cast<int>(promise.size()), promise.data());
  std::abort();
}

}  // namespace clothstream::fuzz
