// SPDX-License-Identifier: MIT
// Checks of values in messages, files and changes.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/messages/field_error.h"
#include "server/messages/limits.h"

namespace clothstream::messages {

// Path of a field in its message. Segments point to their parents, which must outlive them. Nothing is
// allocated unless there is an error.
class Path {
 public:
  Path() = default;  // the message itself
  explicit Path(std::string_view field) : field_(field) {}
  Path operator/(std::string_view field) const { return Path(this, field, -1); }
  Path at(std::string_view field, int index) const { return Path(this, field, index); }

  // Path in JSON names, such as "cloths[0].structural.stiffness".
  std::string text() const;

 private:
  Path(const Path* parent, std::string_view field, int index)
      : parent_(parent), field_(field), index_(index) {}

  const Path* parent_ = nullptr;
  std::string_view field_;
  int index_ = -1;  // index in a repeated field; -1 if it is not repeated
};

// Collects the first error of a conversion. Each check returns its value unchanged, so that a conversion
// needs to test for an error only once, at its end.
class Checks {
 public:
  float number(const Path& path, float value, Range allowed);
  // Mass in kg that a mass per area gives a cloth. `value` is the given number; empty if none is given.
  void derivedMass(const Path& path, std::string_view value, float mass, double area);
  std::uint32_t integer(const Path& path, std::uint32_t value, std::uint32_t min, std::uint32_t max);
  // Number of elements of a repeated field.
  void count(const Path& path, std::size_t count, std::size_t min, std::size_t max);
  // Identifier: 1 to 64 characters out of [a-z0-9_-].
  const std::string& name(const Path& path, const std::string& value);
  // Text for people: one line without control characters, at most kMaxTextBytes.
  const std::string& text(const Path& path, const std::string& value);

  // Name of a participant, shown to others: at most kMaxLabelBytes, without control characters and without
  // the Unicode characters that change direction or break lines.
  const std::string& label(const Path& path, const std::string& value);

  // An empty `value` is not shown.
  void fail(const Path& path, std::string_view value, std::string_view allowed,
            v1::ErrorCode code = v1::ERROR_CODE_INVALID_ARGUMENT);
  // Fails because the server's limit of the size of scenes is exceeded.
  void failSize(const Path& path, std::string_view allowed, std::string_view value = "");

  // Fails with a text from outside as the value. The text is quoted and truncated.
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

// Fails unless one of the elements has this name. nameOf(element) returns its name.
template <typename Named, typename NameOf>
void checkKnown(Checks& checks, const Path& path, const std::string& name, const std::vector<Named>& elements,
                v1::ErrorCode code, const NameOf& nameOf) {
  if (std::ranges::find(elements, name, nameOf) != elements.end()) return;
  std::string known;
  for (const Named& element : elements) known += (known.empty() ? "" : ", ") + std::invoke(nameOf, element);
  checks.fail(path, '"' + name + '"', known.empty() ? "the scene has none" : "must be one of " + known, code);
}

template <typename Named>
void checkKnown(Checks& checks, const Path& path, const std::string& name, const std::vector<Named>& elements,
                v1::ErrorCode code = v1::ERROR_CODE_NOT_FOUND) {
  checkKnown(checks, path, name, elements, code, &Named::name);
}

}  // namespace clothstream::messages
