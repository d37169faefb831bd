// SPDX-License-Identifier: MIT
// The checks that every message, file and change goes through.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/messages/field_error.h"
#include "server/messages/limits.h"

namespace clothstream::messages {

// Where a value lies in its message. Segments point to their parents, which must outlive them: nothing is
// allocated unless something is wrong.
class Path {
 public:
  Path() = default;  // the message itself
  explicit Path(std::string_view field) : field_(field) {}
  Path operator/(std::string_view field) const { return Path(this, field, -1); }
  Path at(std::string_view field, int index) const { return Path(this, field, index); }

  // Such as "cloths[0].structural.stiffness", in the names of the JSON form.
  std::string text() const;

 private:
  Path(const Path* parent, std::string_view field, int index)
      : parent_(parent), field_(field), index_(index) {}

  const Path* parent_ = nullptr;
  std::string_view field_;
  int index_ = -1;  // of a repeated field
};

// Keeps the first error; later ones do not matter. Checks return their value as it is, so that a conversion
// can be written down straight and asked once, at its end, whether all was well.
class Checks {
 public:
  float number(const Path& path, float value, Range allowed);
  std::uint32_t integer(const Path& path, std::uint32_t value, std::uint32_t min, std::uint32_t max);
  // `count` elements of a repeated field.
  void count(const Path& path, std::size_t count, std::size_t min, std::size_t max);
  // 1 to 64 characters out of [a-z0-9_-].
  const std::string& name(const Path& path, const std::string& value);
  // For people: no control characters, at most kMaxTextBytes.
  const std::string& text(const Path& path, const std::string& value);

  // What somebody is called, told to others: short, without control characters, also those of Unicode that
  // turn or break lines.
  const std::string& label(const Path& path, const std::string& value);

  // `value` is empty where there is none to show.
  void fail(const Path& path, std::string_view value, std::string_view allowed,
            v1::ErrorCode code = v1::ERROR_CODE_INVALID_ARGUMENT);

  // The same for a text from outside, which is quoted and cut to what an answer may hold.
  void failNamed(const Path& path, std::string_view name, std::string_view allowed,
                 v1::ErrorCode code = v1::ERROR_CODE_INVALID_ARGUMENT);

  bool failed() const { return error_.has_value(); }
  template <typename T>
  Result<T> result(T value) && {
    if (error_) return tl::unexpected(std::move(*error_));
    return value;
  }

 private:
  std::optional<FieldError> error_;
};

// Whether one of the elements has this name.
template <typename Named>
void checkKnown(Checks& checks, const Path& path, const std::string& name, const std::vector<Named>& elements,
                v1::ErrorCode code = v1::ERROR_CODE_NOT_FOUND) {
  if (std::ranges::find(elements, name, &Named::name) != elements.end()) return;
  std::string known;
  for (const Named& element : elements) known += (known.empty() ? "" : ", ") + element.name;
  checks.fail(path, '"' + name + '"', known.empty() ? "the scene has none" : "must be one of " + known, code);
}

}  // namespace clothstream::messages
