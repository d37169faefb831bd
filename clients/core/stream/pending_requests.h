// SPDX-License-Identifier: MIT
// Requests that the server has not answered yet, and the newest answer.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/core.h"

namespace clothstream::client {

struct Answer {
  std::uint64_t requestId = 0;  // 0 before the first answer
  std::uint32_t request = 0;    // cs_request
  std::uint32_t error = 0;      // ErrorCode; 0 on success
  std::string errorText;
  std::string name;  // scene or file
  std::uint64_t bytes = 0;
  std::string repairs;
};

class PendingRequests {
 public:
  static constexpr std::size_t kMost = 64;

  bool isFull() const { return waiting_.size() == kMost; }
  void add(std::uint64_t id, cs_request request) { waiting_.push_back({id, request}); }
  // Removes and returns the request; nullopt if it does not wait.
  std::optional<cs_request> take(std::uint64_t id) {
    const auto found =
        std::find_if(waiting_.begin(), waiting_.end(), [&](const Waiting& one) { return one.id == id; });
    if (found == waiting_.end()) return std::nullopt;
    const cs_request request = found->request;
    waiting_.erase(found);
    return request;
  }
  void clear() { waiting_.clear(); }

 private:
  struct Waiting {
    std::uint64_t id;
    cs_request request;
  };
  std::vector<Waiting> waiting_;
};

}  // namespace clothstream::client
