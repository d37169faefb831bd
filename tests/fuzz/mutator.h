// SPDX-License-Identifier: MIT
// Changes messages at random and keeps their structure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <random>
#include <span>
#include <string>
#include <string_view>

#include <google/protobuf/message.h>

namespace clothstream::fuzz {

// The result depends only on the seed, the words and the messages. Not thread-safe.
class Mutator {
 public:
  // Changes some of the bytes, and may change their number. May be empty: random changes.
  using ChangeBytes = std::function<void(std::string&)>;

  explicit Mutator(std::uint32_t seed, std::span<const std::string_view> words = {},
                   ChangeBytes changeBytes = {})
      : random_(seed), words_(words), changeBytes_(std::move(changeBytes)) {}

  // Makes one to four changes. A change sets, clears, adds, removes, repeats, moves or copies fields. The
  // message keeps at most `maxBytes` of serialised bytes unless it had more.
  void mutate(google::protobuf::Message& message, std::size_t maxBytes = 1 << 20);

  // Replaces a part of `message` with a part of `other`, which has the same type.
  void crossOver(google::protobuf::Message& message, const google::protobuf::Message& other);

 private:
  using Message = google::protobuf::Message;
  using Field = google::protobuf::FieldDescriptor;

  std::size_t below(std::size_t bound) { return random_() % bound; }
  bool oneIn(std::size_t count) { return below(count) == 0; }

  void change(Message& root, std::size_t room);
  void setField(Message& message, const Field* field, const Message& root);
  // Sets element `index` of a repeated field, or the field if `index` is negative.
  void setValue(Message& message, const Field* field, int index);
  void changeRepeated(Message& message, const Field* field, const Message& root, std::size_t room);
  void fill(Message& message, int depth);

  template <typename Number>
  Number wholeNumber(Number present);
  template <typename Number>
  Number realNumber(Number present);
  void changeText(std::string& text);
  void changeBytes(std::string& bytes);

  std::mt19937 random_;
  std::span<const std::string_view> words_;
  ChangeBytes changeBytes_;
};

}  // namespace clothstream::fuzz
