// SPDX-License-Identifier: MIT
// Chooses the server of the next connection after a server has named another one.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

namespace clothstream::client {

// Connections go to the newest named server, or, before the first name, to the address of the program. When a
// named server does not answer, each kAttemptsPerReturn-th attempt goes to the address of the program,
// because the scene may have moved on meanwhile. All times are microseconds.
class Redirection {
 public:
  // Most names that are followed in this time without a joined stream in between, and most announced ones.
  static constexpr std::uint32_t kMost = 3;
  static constexpr std::uint64_t kWindowUs = 60'000'000;
  static constexpr std::uint32_t kAttemptsPerReturn = 4;

  // Returns false, and changes nothing, if too many names were followed, or if the present server has named
  // itself.
  bool follow(std::string name, std::uint64_t nowUs) {
    if (name == server()) return false;
    if (count_ > 0 && nowUs - firstUs_ >= kWindowUs) count_ = 0;
    if (count_ == kMost) return false;
    if (count_++ == 0) firstUs_ = nowUs;
    server_ = std::move(name);
    failures_ = 0;
    attempting_ = false;
    return true;
  }
  // The scene moves to a server of this name soon. Returns false if the client must not connect there yet: it
  // is the present one, or too many names were announced.
  bool announce(const std::string& name, std::uint64_t nowUs) {
    if (name == server()) return false;
    if (announced_ > 0 && nowUs - firstAnnouncedUs_ >= kWindowUs) announced_ = 0;
    if (announced_ == kMost) return false;
    if (announced_++ == 0) firstAnnouncedUs_ = nowUs;
    return true;
  }
  void attempting() { attempting_ = true; }
  void welcomed() {
    if (isReturn()) server_.clear();
    attempting_ = false;
    failures_ = 0;
  }
  void joined() { count_ = 0; }
  // The connection has ended.
  void ended() {
    if (std::exchange(attempting_, false)) ++failures_;
  }

  // Empty: the address of the program.
  const std::string& server() const { return isReturn() ? kNone : server_; }
  // Whether a server is named, but server() is empty.
  bool isReturn() const {
    return !server_.empty() && failures_ % kAttemptsPerReturn == kAttemptsPerReturn - 1;
  }

 private:
  inline static const std::string kNone;

  std::string server_;
  std::uint32_t count_ = 0;  // names followed since firstUs_
  std::uint64_t firstUs_ = 0;
  std::uint32_t announced_ = 0;  // names announced since firstAnnouncedUs_
  std::uint64_t firstAnnouncedUs_ = 0;
  std::uint32_t failures_ = 0;  // attempts without Welcome since the last one, or since the newest name
  bool attempting_ = false;     // a connection without Welcome exists
};

}  // namespace clothstream::client
