// SPDX-License-Identifier: MIT
// Text of JSON that a command prints or writes.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "proto/text/printable.h"

namespace clothstream::cli {

// Names come from servers and files: bytes that are not UTF-8 are replaced, and characters that could control
// a terminal are written as \uXXXX, which means the same. indent: -1 writes a single line.
template <typename Json>
std::string jsonText(const Json& json, int indent) {
  return printableJson(json.dump(indent, ' ', false, Json::error_handler_t::replace));
}

}  // namespace clothstream::cli
