// SPDX-License-Identifier: MIT
// REST calls of Agones' sidecar, which runs in the same pod.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace clothstream::agones {

// Belongs to one thread. Each call takes at most kTimeout.
class Sidecar {
 public:
  static constexpr std::chrono::milliseconds kTimeout{2'000};

  enum class Answer : std::uint8_t {
    ok,
    unknown,      // the GameServer has no counter or list of this name
    refused,      // another error; `problem()` has its text
    unreachable,  // no answer, for example because the sidecar starts later
  };

  // Port on this machine: AGONES_SDK_HTTP_PORT.
  explicit Sidecar(std::uint16_t port) : port_(port) {}

  Answer ready() { return post("/ready"); }
  Answer health() { return post("/health"); }
  Answer allocate() { return post("/allocate"); }
  Answer shutdown() { return post("/shutdown"); }
  // State of the GameServer, such as "Allocated". Empty if the answer is not `ok`.
  Answer state(std::string& state);
  Answer setCounter(const std::string& name, std::int64_t count, std::int64_t capacity);
  Answer addToList(const std::string& name, const std::string& value);
  Answer removeFromList(const std::string& name, const std::string& value);
  // Values in the list. Empty if the answer is not `ok`.
  Answer list(const std::string& name, std::vector<std::string>& values);

  // Explains the newest call that was refused or had no answer.
  const std::string& problem() const { return problem_; }

 private:
  Answer post(const std::string& path);
  Answer call(const char* method, const std::string& path, const std::string& body, std::string& answer);

  const std::uint16_t port_;
  std::string problem_;
};

}  // namespace clothstream::agones
