// SPDX-License-Identifier: MIT
// Implementation with fork, exec and poll.
#include "tests/e2e/process.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <sstream>
#include <system_error>

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>

namespace clothstream::e2e {
namespace {

using SteadyClock = std::chrono::steady_clock;

struct Pipe {
  int readEnd = -1, writeEnd = -1;
};

void check(int result, const char* what) {
  if (result < 0) throw std::system_error(errno, std::generic_category(), what);
}

Pipe makePipe(Process::Output kind) {
  Pipe pipe;
  if (kind == Process::Output::terminal) {
    check(openpty(&pipe.readEnd, &pipe.writeEnd, nullptr, nullptr, nullptr), "openpty");
  } else {
    int ends[2];
    check(::pipe(ends), "pipe");
    pipe = {ends[0], ends[1]};
  }
  check(fcntl(pipe.readEnd, F_SETFD, FD_CLOEXEC), "fcntl");
  return pipe;
}

int remainingMs(SteadyClock::time_point deadline) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - SteadyClock::now()).count();
  return static_cast<int>(std::max<decltype(left)>(left, 0));
}

}  // namespace

Process::Process(const std::vector<std::string>& command, Output output) {
  const Pipe out = makePipe(output), err = makePipe(Output::pipe);
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  pid_ = fork();
  check(pid_, "fork");
  if (pid_ == 0) {
    dup2(out.writeEnd, STDOUT_FILENO);
    dup2(err.writeEnd, STDERR_FILENO);
    close(out.writeEnd);
    close(err.writeEnd);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  close(out.writeEnd);
  close(err.writeEnd);
  output_.file = out.readEnd;
  errors_.file = err.readEnd;
}

Process::~Process() {
  if (!exitCode_) {
    signal(SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  for (const Stream* stream : {&output_, &errors_}) {
    if (stream->file >= 0) close(stream->file);
  }
}

void Process::signal(int number) const {
  if (!exitCode_) kill(pid_, number);
}

void Process::readFrom(Stream& stream) {
  std::array<char, 4096> buffer;
  const ssize_t count = ::read(stream.file, buffer.data(), buffer.size());
  if (count > 0) {
    stream.text.append(buffer.data(), static_cast<std::size_t>(count));
  } else if (count == 0 || errno != EINTR) {  // a terminal whose other end is closed reports EIO
    close(stream.file);
    stream.file = -1;
  }
}

bool Process::read(Deadline deadline) {
  std::array<pollfd, 2> files{pollfd{output_.file, POLLIN, 0}, pollfd{errors_.file, POLLIN, 0}};
  if (files[0].fd < 0 && files[1].fd < 0) return false;
  if (poll(files.data(), files.size(), remainingMs(deadline)) <= 0) return false;
  if (files[0].revents != 0) readFrom(output_);
  if (files[1].revents != 0) readFrom(errors_);
  return true;
}

bool Process::waitForOutput(const std::string& text, std::chrono::milliseconds timeout) {
  const Deadline deadline = SteadyClock::now() + timeout;
  do {
    if (output_.text.find(text) != std::string::npos) return true;
  } while (read(deadline));
  return false;
}

std::optional<std::string> Process::waitForLine(const std::string& start, std::chrono::milliseconds timeout) {
  const Deadline deadline = SteadyClock::now() + timeout;
  do {
    std::istringstream lines(output_.text);
    // Skips the last line while its end is missing.
    for (std::string line; std::getline(lines, line) && !lines.eof();) {
      if (line.starts_with(start)) return line.substr(start.size());
    }
  } while (read(deadline));
  return std::nullopt;
}

std::optional<int> Process::waitForEnd(std::chrono::milliseconds timeout) {
  const Deadline deadline = SteadyClock::now() + timeout;
  while (read(deadline)) {
  }
  if (exitCode_ || output_.file >= 0 || errors_.file >= 0) return exitCode_;
  // Both streams are closed, so the program is ending.
  int status = 0;
  check(waitpid(pid_, &status, 0), "waitpid");
  exitCode_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return exitCode_;
}

}  // namespace clothstream::e2e
