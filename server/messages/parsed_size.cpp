// SPDX-License-Identifier: MIT
#include "server/messages/parsed_size.h"

#include <algorithm>
#include <cstdint>
#include <unordered_map>

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/message.h>
#include <google/protobuf/wire_format_lite.h>

namespace clothstream::messages {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

constexpr int kMaxDepth = 100;  // the parser's default
// Bookkeeping of an allocated block, and its rounding.
constexpr std::size_t kBlock = 32;
// Capacities of repeated fields double, and both arrays exist while elements move.
constexpr std::size_t kGrowth = 3;
// An unknown field, which the parser keeps. In a group each one may take two bytes of input.
constexpr std::size_t kUnknown = kGrowth * 16 + kBlock;

WireFormatLite::WireType wireTypeOf(const FieldDescriptor& field) {
  return WireFormatLite::WireTypeForFieldType(static_cast<WireFormatLite::FieldType>(field.type()));
}

// Null for a field that the parser keeps as an unknown one: its number is unknown, or its wire type is not
// that of the field.
const FieldDescriptor* knownField(const Descriptor& type, std::uint32_t tag) {
  const FieldDescriptor* const field = type.FindFieldByNumber(WireFormatLite::GetTagFieldNumber(tag));
  if (field == nullptr) return nullptr;
  const WireFormatLite::WireType wireType = WireFormatLite::GetTagWireType(tag);
  const bool isPacked = field->is_packable() && wireType == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
  return isPacked || wireType == wireTypeOf(*field) ? field : nullptr;
}

std::size_t numberBytes(const FieldDescriptor& field) {
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_BOOL:
      return 1;
    case FieldDescriptor::CPPTYPE_INT64:
    case FieldDescriptor::CPPTYPE_UINT64:
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return 8;
    default:
      return 4;
  }
}

class Sum {
 public:
  explicit Sum(std::size_t limit) : limit_(limit) {}

  std::size_t size() const { return size_; }
  bool isTooLarge() const { return isTooLarge_; }
  bool addMessage(const Descriptor& type, CodedInputStream& input, int depth) {
    if (depth > kMaxDepth || !add(sizeOf(type))) return false;
    while (const std::uint32_t tag = input.ReadTag())
      if (!addField(type, tag, input, depth)) return false;
    return input.ConsumedEntireMessage();
  }

 private:
  bool add(std::size_t bytes) {
    isTooLarge_ = bytes > limit_ - size_;
    if (isTooLarge_) return false;
    size_ += bytes;
    return true;
  }

  std::size_t sizeOf(const Descriptor& type) {
    const auto [found, isNew] = sizes_.try_emplace(&type, 0);
    if (isNew)
      found->second =
          google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->SpaceUsedLong() +
          kBlock;
    return found->second;
  }

  bool addField(const Descriptor& type, std::uint32_t tag, CodedInputStream& input, int depth) {
    const FieldDescriptor* const field = knownField(type, tag);
    const bool hasLength = WireFormatLite::GetTagWireType(tag) == WireFormatLite::WIRETYPE_LENGTH_DELIMITED;
    if (field == nullptr || !hasLength) {
      const int before = input.CurrentPosition();
      if (!WireFormatLite::SkipField(&input, tag)) return false;
      const auto bytes = static_cast<std::size_t>(input.CurrentPosition() - before);
      if (field == nullptr) return add(kUnknown * (1 + bytes / 2));
      return !field->is_repeated() || add(kGrowth * numberBytes(*field));
    }
    std::uint32_t length = 0;
    if (!input.ReadVarint32(&length) || length > static_cast<std::uint32_t>(input.BytesUntilLimit()))
      return false;
    if (field->is_repeated() && !add(kGrowth * sizeof(void*))) return false;
    switch (field->cpp_type()) {
      case FieldDescriptor::CPPTYPE_MESSAGE: {
        const CodedInputStream::Limit outer = input.PushLimit(static_cast<int>(length));
        if (!addMessage(*field->message_type(), input, depth + 1)) return false;
        input.PopLimit(outer);
        return true;
      }
      case FieldDescriptor::CPPTYPE_STRING:
        return add(sizeof(std::string) + 2 * kBlock + length) && input.Skip(static_cast<int>(length));
      default:
        return addPacked(*field, length, input);
    }
  }

  bool addPacked(const FieldDescriptor& field, std::uint32_t length, CodedInputStream& input) {
    const CodedInputStream::Limit outer = input.PushLimit(static_cast<int>(length));
    std::size_t elements = 0;
    const void* data = nullptr;
    for (int size = 0; input.BytesUntilLimit() > 0 && input.GetDirectBufferPointer(&data, &size);) {
      size = std::min(size, input.BytesUntilLimit());
      // The last byte of a varint is below 128. Fixed-size elements have at least as many bytes in the input.
      const auto* const bytes = static_cast<const std::uint8_t*>(data);
      const bool isVarint = wireTypeOf(field) == WireFormatLite::WIRETYPE_VARINT;
      elements += isVarint ? static_cast<std::size_t>(std::count_if(
                                 bytes, bytes + size, [](std::uint8_t byte) { return byte < 128; }))
                           : static_cast<std::size_t>(size) / numberBytes(field) + 1;
      input.Skip(size);
    }
    input.PopLimit(outer);
    return add(kBlock + kGrowth * elements * numberBytes(field));
  }

  std::size_t limit_, size_ = 0;
  bool isTooLarge_ = false;
  std::unordered_map<const Descriptor*, std::size_t> sizes_;
};

}  // namespace

tl::expected<std::size_t, SizeError> parsedSize(const Descriptor& type, std::span<const std::byte> bytes,
                                                std::size_t limit) {
  CodedInputStream input(reinterpret_cast<const std::uint8_t*>(bytes.data()), static_cast<int>(bytes.size()));
  input.PushLimit(static_cast<int>(bytes.size()));
  Sum sum(limit);
  if (!sum.addMessage(type, input, 0))
    return tl::unexpected(sum.isTooLarge() ? SizeError::tooLarge : SizeError::malformed);
  return sum.size();
}

}  // namespace clothstream::messages
