// SPDX-License-Identifier: MIT
// Calls that wait until everything is written.
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <utility>

namespace clothstream::saved_state {

// Requests are numbered. A pass of the writer serves the requests that were made before it began. Not
// thread-safe.
class FlushRequests {
 public:
  // Returns the number of the request. `name` is the scene that it waits for; empty: all scenes.
  std::uint64_t add(const std::string& name) {
    names_.insert(name);
    return ++newest_;
  }
  std::uint64_t newest() const { return newest_; }
  // Whether a request waits for a pass.
  bool waits() const { return newest_ > served_; }
  // Names of the requests since the previous call.
  std::set<std::string> takeNames() { return std::exchange(names_, {}); }

  // A pass has served the requests up to this one. `failed`: it ended early.
  void serve(std::uint64_t number, bool failed) {
    served_ = number;
    failed_ = failed;
  }
  bool isServed(std::uint64_t number) const { return served_ >= number; }
  // Whether the newest pass ended early.
  bool failed() const { return failed_; }

 private:
  std::set<std::string> names_;
  std::uint64_t newest_ = 0, served_ = 0;
  bool failed_ = false;
};

}  // namespace clothstream::saved_state
