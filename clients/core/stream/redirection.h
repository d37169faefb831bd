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

  // Whether the program opens connections at server(). Default: no.
  void enable(bool on) { enabled_ = on; }
  bool isEnabled() const { return enabled_; }

  // Returns false, and changes nothing, if too many names were followed, or if the present server has named
  // itself.
  bool follow(std::string name, std::uint64_t nowUs) {
    if (name == server() || !followed_.add(nowUs)) return false;
    server_ = std::move(name);
    failures_ = 0;
    attempting_ = false;
    return true;
  }
  // The scene moves to a server of this name soon. Returns false, and changes nothing, if the client must not
  // connect there yet: it is the present one, too many names were announced, or names are not followed.
  bool announce(std::string name, std::uint64_t nowUs) {
    if (!enabled_ || name.empty() || name == server() || !announced_.add(nowUs)) return false;
    next_ = std::move(name);
    return true;
  }
  void attempting() {
    attempting_ = true;
    next_.clear();
  }
  void welcomed() {
    if (isReturn()) server_.clear();
    attempting_ = false;
    failures_ = 0;
  }
  void joined() { followed_ = {}; }
  // The connection has ended.
  void ended() {
    if (std::exchange(attempting_, false)) ++failures_;
  }

  // Empty: the address of the program.
  const std::string& server() const { return isReturn() ? kNone : server_; }
  // To which the scene moves soon; empty: none.
  const std::string& next() const { return next_; }
  // Whether a server is named, but server() is empty.
  bool isReturn() const {
    return !server_.empty() && failures_ % kAttemptsPerReturn == kAttemptsPerReturn - 1;
  }

 private:
  // Counts names, at most kMost in a window that begins with the first.
  struct Names {
    std::uint32_t count = 0;
    std::uint64_t firstUs = 0;

    bool add(std::uint64_t nowUs) {
      if (count > 0 && nowUs - firstUs >= kWindowUs) count = 0;
      if (count == kMost) return false;
      if (count++ == 0) firstUs = nowUs;
      return true;
    }
  };

  inline static const std::string kNone;

  bool enabled_ = false;
  std::string server_, next_;
  Names followed_, announced_;
  std::uint32_t failures_ = 0;  // attempts without Welcome since the last one, or since the newest name
  bool attempting_ = false;     // a connection without Welcome exists
};

}  // namespace clothstream::client
