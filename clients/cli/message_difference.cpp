// SPDX-License-Identifier: MIT
// Lists differences with protobuf's own comparison.
#include "clients/cli/message_difference.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include <fmt/format.h>
#include <google/protobuf/text_format.h>
#include <google/protobuf/util/message_differencer.h>

namespace clothstream::cli {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::TextFormat;
using google::protobuf::util::MessageDifferencer;

constexpr std::size_t kMaxListed = 3;
constexpr std::size_t kMaxValue = 40;  // bytes of a printed value

// Keeps the first differences as text and counts the others.
class FirstDifferences : public MessageDifferencer::Reporter {
 public:
  using Path = std::vector<MessageDifferencer::SpecificField>;

  void ReportAdded(const Message&, const Message& b, const Path& path) override {
    add(path, [&] { return fmt::format("absent, became {}", valueOf(b, path, true)); });
  }
  void ReportDeleted(const Message& a, const Message&, const Path& path) override {
    add(path, [&] { return fmt::format("{}, became absent", valueOf(a, path, false)); });
  }
  void ReportModified(const Message& a, const Message& b, const Path& path) override {
    // The fields of a changed message have been reported before.
    if (path.back().field != nullptr && path.back().field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE)
      return;
    add(path, [&] { return fmt::format("{} became {}", valueOf(a, path, false), valueOf(b, path, true)); });
  }

  std::string text() const {
    if (count_ <= kMaxListed) return text_;
    return fmt::format("{}; {} more", text_, count_ - kMaxListed);
  }

 private:
  template <typename Describe>
  void add(const Path& path, const Describe& describe) {
    if (count_++ >= kMaxListed) return;
    if (!text_.empty()) text_ += "; ";
    for (std::size_t i = 0; i < path.size(); ++i) {
      if (path[i].field == nullptr) continue;
      text_ += fmt::format("{}{}", i > 0 ? "." : "", path[i].field->name());
      if (path[i].field->is_repeated())
        text_ += fmt::format("[{}]", std::max(path[i].index, path[i].new_index));
    }
    text_ += ": " + describe();
  }

  // `parent` has the last field of the path.
  static std::string valueOf(const Message& parent, const Path& path, bool isNew) {
    const MessageDifferencer::SpecificField& place = path.back();
    if (place.field == nullptr) return "an unknown field";
    const int index = place.field->is_repeated() ? (isNew ? place.new_index : place.index) : -1;
    TextFormat::Printer printer;
    printer.SetSingleLineMode(true);
    std::string value;
    printer.PrintFieldValueToString(parent, place.field, index, &value);
    if (place.field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) value = "{ " + value + "}";
    if (value.size() > kMaxValue) value = value.substr(0, kMaxValue) + "...";
    return value;
  }

  std::string text_;
  std::size_t count_ = 0;
};

}  // namespace

std::string differenceOf(const Message& a, const Message& b) {
  FirstDifferences differences;
  MessageDifferencer differencer;
  differencer.ReportDifferencesTo(&differences);
  return differencer.Compare(a, b) ? std::string() : differences.text();
}

}  // namespace clothstream::cli
