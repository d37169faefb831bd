// SPDX-License-Identifier: MIT
// Checks single values and writes the error texts.
#include "server/messages/validation.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "proto/text/excerpt.h"
#include "proto/text/printable.h"
#include "proto/text/utf8.h"

namespace clothstream::messages {
namespace {

// Maximum length of a value in an error text. An answer is then not larger than its request.
constexpr std::size_t kMaxShown = 80;
// The same of values that may be paths of files.
constexpr std::size_t kMaxValue = 1024;

std::string inQuotes(std::string_view value) {
  std::string shown = "\"";
  for (const char c : value.substr(0, kMaxShown)) shown += c >= 0x20 && c < 0x7f ? c : '?';
  return shown + (value.size() > kMaxShown ? "...\"" : "\"");
}

}  // namespace

std::string Path::text() const {
  std::string before = parent_ == nullptr ? "" : parent_->text();
  if (!before.empty() && !field_.empty()) before += '.';
  before += field_;
  return index_ < 0 ? before : fmt::format("{}[{}]", before, index_);
}

float Checks::number(const Path& path, float value, Range allowed) {
  if (!(value >= static_cast<float>(allowed.min) && value <= static_cast<float>(allowed.max)))
    fail(path, fmt::format("{}", value),
         fmt::format("must be a finite number from {:g} to {:g}", allowed.min, allowed.max));
  return value;
}

void Checks::derivedMass(const Path& path, std::string_view value, float mass, double area) {
  const Range allowed = limits::kMass;
  if (mass >= static_cast<float>(allowed.min) && mass <= static_cast<float>(allowed.max)) return;
  fail(path, value,
       fmt::format(
           "gives the cloth of {:g} m^2 a mass of {:g} kg, which must be from {:g} to {:g}; change the "
           "mass per area or the size of the cloth",
           area, mass, allowed.min, allowed.max));
}

std::uint32_t Checks::integer(const Path& path, std::uint32_t value, std::uint32_t min, std::uint32_t max) {
  if (value < min || value > max)
    fail(path, fmt::format("{}", value), fmt::format("must be a whole number from {} to {}", min, max));
  return value;
}

void Checks::count(const Path& path, std::size_t count, std::size_t min, std::size_t max) {
  if (count < min || count > max)
    fail(path, "", fmt::format("has {} elements; must have {} to {}", count, min, max));
}

const std::string& Checks::name(const Path& path, const std::string& value) {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  };
  if (value.empty() || value.size() > limits::kMaxNameLength || !std::ranges::all_of(value, allowed))
    fail(path, inQuotes(value),
         fmt::format("must be 1 to {} characters out of [a-z0-9_-]", limits::kMaxNameLength));
  return value;
}

const std::string& Checks::text(const Path& path, const std::string& value) {
  if (value.size() > limits::kMaxTextBytes || !isUtf8(value) || hasControlCharacters(value))
    fail(path, inQuotes(value),
         fmt::format("must be one line of at most {} bytes of UTF-8 without control characters",
                     limits::kMaxTextBytes));
  return value;
}

const std::string& Checks::label(const Path& path, const std::string& value) {
  if (value.size() > limits::kMaxLabelBytes || !isUtf8(value) || hasControlCharacters(value))
    fail(path, inQuotes(value),
         fmt::format("must be at most {} bytes of UTF-8 without control characters", limits::kMaxLabelBytes));
  return value;
}

void Checks::failNamed(const Path& path, std::string_view name, std::string_view allowed,
                       v1::ErrorCode code) {
  fail(path, inQuotes(name), allowed, code);
}

void Checks::failSize(const Path& path, std::string_view allowed, std::string_view value) {
  if (error_) return;
  fail(path, value, allowed);
  error_->limit = telemetry::Refusal::sceneSize;
}

void Checks::fail(const Path& path, std::string_view value, std::string_view allowed, v1::ErrorCode code) {
  if (error_) return;
  std::string where = path.text();
  if (!value.empty()) where += fmt::format("{}= {}", where.empty() ? "" : " ", excerpt(value, kMaxValue));
  error_ = FieldError{code, where.empty() ? std::string(allowed) : fmt::format("{}: {}", where, allowed)};
}

}  // namespace clothstream::messages
