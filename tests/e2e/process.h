// SPDX-License-Identifier: MIT
// Another program, started, read and ended by a test.
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

  // Starts it; standard output comes through a pipe or as from a terminal, standard error through a pipe.
  // Throws std::system_error.
  explicit Process(const std::vector<std::string>& command, Output output = Output::pipe);
  // Kills it if it still runs.
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  // Until standard output holds `text`. False if it ends or the time is over before.
  bool waitForOutput(const std::string& text, std::chrono::milliseconds timeout);
  // The rest of the first line of standard output that begins with `start`.
  std::optional<std::string> waitForLine(const std::string& start, std::chrono::milliseconds timeout);
  // Its exit code, or 128 + the signal that ended it; nothing if it still runs when the time is over.
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

  // Takes what is there, waiting for it until the deadline. False when both streams are at their ends or time
  // is over.
  bool read(Deadline deadline);
  static void readFrom(Stream& stream);

  pid_t pid_ = -1;
  std::optional<int> exitCode_;
  Stream output_, errors_;
};

}  // namespace clothstream::e2e
