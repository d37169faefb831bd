// SPDX-License-Identifier: MIT
// Error about a refused value from outside.
#pragma once

#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "server/telemetry/refusal.h"

namespace clothstream::messages {

// `text` gives the path of the field, its value and the allowed values, such as
//   cloths[0].structural.stiffness = -3: must be a finite number from 0 to 1e+06
struct FieldError {
  v1::ErrorCode code = v1::ERROR_CODE_INVALID_ARGUMENT;
  std::string text;
  std::optional<telemetry::Refusal> limit = {};  // that was reached, if any; for metrics
};

template <typename T>
using Result = tl::expected<T, FieldError>;

}  // namespace clothstream::messages
