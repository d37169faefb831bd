// SPDX-License-Identifier: MIT
// clothstream-server as a process of its own, its words line by line.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include <sys/types.h>

namespace clothstream::tests {

// Belongs to one thread. What it waits for must come within kPatience, or it throws std::runtime_error with
// all that the program said.
class ServerProcess {
 public:
  static constexpr std::chrono::seconds kPatience{60};

  explicit ServerProcess(const std::vector<std::string>& options);
  // Kills it if it still runs.
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  // Reads on until a line contains this; returns the line.
  std::string lineWith(const std::string& text);
  // Of the line "page    http://127.0.0.1:8080/" or "gRPC    127.0.0.1:50051".
  std::uint16_t portIn(const std::string& line) const;

  void signal(int number) const;
  // Reads to the end; the program's exit code, or minus the signal that ended it.
  int exitCode();
  // Standard output and error so far, in the order in which they came.
  const std::string& said() const { return said_; }

 private:
  // False at the end of the output.
  bool read(std::chrono::steady_clock::time_point deadline);

  pid_t pid_ = -1;
  int output_ = -1;
  std::string said_;
  std::size_t searched_ = 0;  // lines before this were returned or passed over
};

}  // namespace clothstream::tests
