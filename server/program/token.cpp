// SPDX-License-Identifier: MIT
// `clothstream-server token`: makes tokens and their keys.
#include "server/identity/token.h"

#include <stdexcept>
#include <string>

#include <fmt/format.h>

#include "server/program/commands.h"

namespace clothstream::program {

int runToken(const TokenOptions& token, const std::string& audience) {
  if (!token.newKey.empty()) {
    identity::makeTokenKey(token.newKey);
    return 0;
  }
  const identity::Claims claims{.role = token.role,
                                .scene = token.scene,
                                .name = token.name,
                                .subject = token.subject,
                                .tenant = token.tenant,
                                .audience = audience,
                                .expires = identity::WallClock::now() + token.valid,
                                .notBefore = {}};
  const identity::TokenKey key = identity::readTokenKey(token.key);
  const std::string text = identity::sign(key, claims);
  // A server would refuse names that are too long, for example.
  const auto checked = identity::check(text, {{key.id, key}}, audience, identity::WallClock::now());
  if (!checked) throw std::runtime_error(checked.error().text);
  fmt::print("{}\n", text);
  return 0;
}

}  // namespace clothstream::program
