// SPDX-License-Identifier: MIT
// The parameters that hold at some time of a recorded stream.
#pragma once

#include <utility>

#include "clothstream/v1/session.pb.h"

namespace clothstream::recording {

// Safe on any messages: what they say of cloths that the stream does not have is passed over. Colliders are
// told by each frame, and not here.
class ParametersInForce {
 public:
  // As when the stream began: of nothing that its definition does not tell.
  explicit ParametersInForce(const v1::StreamDescription& description);
  // These, which are all.
  explicit ParametersInForce(v1::ParameterChange all) : now_(std::move(all)) {}

  // Those told later come later.
  void apply(const v1::ParameterChange& change);

  // All of them, as one change.
  const v1::ParameterChange& now() const { return now_; }

 private:
  v1::ParameterChange now_;
};

}  // namespace clothstream::recording
