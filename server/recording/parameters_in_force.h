// SPDX-License-Identifier: MIT
// Parameters in effect at a time of a recorded stream.
#pragma once

#include <utility>

#include "clothstream/v1/session.pb.h"

namespace clothstream::recording {

// Safe for any messages: changes of unknown cloths are ignored. Colliders are part of each frame and not
// included here.
class ParametersInForce {
 public:
  // Parameters at the start of the stream, as far as its definition gives them.
  explicit ParametersInForce(const v1::StreamDescription& description);
  // `all` must hold all parameters.
  explicit ParametersInForce(v1::ParameterChange all) : now_(std::move(all)) {}

  // Changes must be applied in the order of the stream.
  void apply(const v1::ParameterChange& change);

  // All parameters as one change.
  const v1::ParameterChange& now() const { return now_; }

 private:
  v1::ParameterChange now_;
};

}  // namespace clothstream::recording
