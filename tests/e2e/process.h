// SPDX-License-Identifier: MIT
// Runs another program: reads its output, sends it signals, waits for its end.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

namespace clothstream::e2e {

class Process {
 public:
  enum class Output { pipe, terminal };

  // Starts the program. Standard output goes to a pipe or a pseudo-terminal, standard error to a pipe. Throws
  // std::system_error.
  explicit Process(const std::vector<std::string>& command, Output output = Output::pipe);
  // Kills the program if it still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // Waits until standard output contains `text`. Returns false if the output ends or the time is over first.
  bool waitForOutput(const std::string& text, std::chrono::milliseconds timeout);
  // Waits for the first line of standard output that begins with `start`, and returns the rest of that line.
  std::optional<std::string> waitForLine(const std::string& start, std::chrono::milliseconds timeout);
  // Exit code, or 128 + the number of the signal that ended the program. Nothing if it still runs after the
  // timeout.
  std::optional<int> waitForEnd(std::chrono::milliseconds timeout);
  void signal(int number) const;
  pid_t id() const { return pid_; }

  const std::string& output() const { return output_.text; }
  const std::string& errors() const { return errors_.text; }

 private:
  using Deadline = std::chrono::steady_clock::time_point;
  struct Stream {
    int file = -1;
    std::string text;
  };

  // Waits for output until the deadline and reads it. Returns false when both streams have ended or the time
  // is over.
  bool read(Deadline deadline);
  static void readFrom(Stream& stream);

  pid_t pid_ = -1;
  std::optional<int> exitCode_;
  Stream output_, errors_;
};

}  // namespace clothstream::e2e
