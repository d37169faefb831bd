// SPDX-License-Identifier: MIT
// Runs clothstream-server as a child process and reads its output by lines.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include <sys/types.h>

namespace clothstream::tests {

// Belongs to one thread. Throws std::runtime_error with the whole output if an awaited line or the end does
// not come within kPatience.
class ServerProcess {
 public:
  static constexpr std::chrono::seconds kPatience{60};

  // `environment` is a list of NAME=VALUE, added to the variables of the test.
  explicit ServerProcess(const std::vector<std::string>& options,
                         const std::vector<std::string>& environment = {});
  // Kills the program if it still runs.
  ~ServerProcess();
  ServerProcess(const ServerProcess&) = delete;
  ServerProcess& operator=(const ServerProcess&) = delete;

  // Reads until a line contains `text`, and returns that line.
  std::string lineWith(const std::string& text);
  // Port in the line "page    http://127.0.0.1:8080/" or "gRPC    127.0.0.1:50051".
  std::uint16_t portIn(const std::string& line) const;

  void signal(int number) const;
  // Reads to the end of the output. Returns the program's exit code, or the negative number of the signal
  // that ended it.
  int exitCode();
  // Standard output and standard error so far, in order of arrival.
  const std::string& output() const { return output_; }

 private:
  // False at the end of the output.
  bool read(std::chrono::steady_clock::time_point deadline);

  pid_t pid_ = -1;
  int pipe_ = -1;
  std::string output_;
  std::size_t searched_ = 0;  // offset of the first line that lineWith() has not read
};

}  // namespace clothstream::tests
