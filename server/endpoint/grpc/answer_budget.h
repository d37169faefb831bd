// SPDX-License-Identifier: MIT
// Limits the memory of answers that clients have not read yet.
#pragma once

#include <cstddef>
#include <string>
#include <unordered_map>

namespace clothstream::endpoint {

struct AnswerLimits {
  std::size_t bytes = std::size_t{64} << 20;           // of all calls
  std::size_t bytesOfAddress = std::size_t{32} << 20;  // of the calls of one address, other than loopback
};

// Counts the bytes of the answers that are being sent. Not thread-safe.
class AnswerBudget {
 public:
  explicit AnswerBudget(const AnswerLimits& limits) : limits_(limits) {}

  // Takes `bytes` for a call of the address with this key (addressKey). Returns false, and takes nothing, if
  // that exceeds a limit. An answer larger than a limit is allowed while no other one counts for that limit.
  [[nodiscard]] bool take(const std::string& key, std::size_t bytes);
  // Gives back what take() took.
  void release(const std::string& key, std::size_t bytes);

 private:
  const AnswerLimits limits_;
  std::size_t used_ = 0;
  std::unordered_map<std::string, std::size_t> ofAddress_;  // no entry is 0
};

}  // namespace clothstream::endpoint
