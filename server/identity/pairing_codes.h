// SPDX-License-Identifier: MIT
// Six-digit codes that prove that a person sees the output of the server or an owner's page.
#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "server/messages/field_error.h"
#include "server/scene/roles.h"
#include "server/schedule/clock.h"

namespace clothstream::identity {

using schedule::Clock;

struct PairingCode {
  std::string code;  // six digits
  scene::Role role = scene::Role::none;
  Clock::time_point ends{};
};

// At most one code for each role. Not thread-safe.
class PairingCodes {
 public:
  static constexpr std::chrono::minutes kValid{5};
  // Number of wrong codes after which an address is locked out.
  static constexpr int kWrongPerAddress = 5;
  static constexpr std::chrono::minutes kLockout{1};
  // Number of wrong codes from all addresses together after which all codes end. A guesser therefore succeeds
  // with a probability of at most 20 x 3 / 1,000,000 before a person has to ask for a new code.
  static constexpr int kWrongInAll = 20;

  // Makes a code from random numbers of the system, and ends the former one of this role.
  PairingCode make(scene::Role role, Clock::time_point now);

  // Returns the role of the code, or WRONG_PAIRING_CODE and why. `address` groups the attempts of one peer.
  // All comparisons take constant time.
  [[nodiscard]] messages::Result<scene::Role> take(const std::string& code, const std::string& address,
                                                   Clock::time_point now);

 private:
  // Attempts of an address that has sent wrong codes.
  struct Wrong {
    std::string address;
    int count = 0;
    Clock::time_point newest{};
  };

  static constexpr std::size_t kMaxAddresses = 256;

  // Drops codes that have ended, and addresses whose wrong codes no longer count.
  void expire(Clock::time_point now);
  Wrong& wrongOf(const std::string& address);

  std::vector<PairingCode> codes_;
  std::vector<Wrong> wrong_;  // at most kMaxAddresses; the oldest is replaced
  int wrongInAll_ = 0;        // since the newest code was made
};

}  // namespace clothstream::identity
