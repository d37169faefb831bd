// SPDX-License-Identifier: MIT
// First differences of two protobuf messages as text.
#pragma once

#include <string>

#include <google/protobuf/message.h>

namespace clothstream::cli {

// Returns for example "wind.x: 1 became 2", with at most three differences; "" if the messages are equal.
// Floats are equal if their bits are, or if both are zero.
std::string differenceOf(const google::protobuf::Message& a, const google::protobuf::Message& b);

}  // namespace clothstream::cli
