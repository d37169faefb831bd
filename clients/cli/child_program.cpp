// SPDX-License-Identifier: MIT
// Starts the program with posix_spawn, with a pipe as its standard output.
#include "clients/cli/child_program.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace clothstream::cli {
namespace {

constexpr std::size_t kMaxOutput = std::size_t{64} << 20;
constexpr int kSignalBase = 128;

// Starts the program with `output` as its standard output. Returns 0 or the error of the system.
int start(const std::vector<std::string>& command, int output, pid_t& child) {
  std::vector<char*> arguments;
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  // This program blocks the signals that end it; the other one shall not.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  const int error = posix_spawnp(&child, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  return error;
}

// Reads to the end. Returns false if there is too much.
bool readAll(int input, std::string& text) {
  std::array<char, 65'536> bytes{};
  for (;;) {
    const ssize_t count = ::read(input, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return true;
    if (text.size() + static_cast<std::size_t>(count) > kMaxOutput) return false;
    text.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

}  // namespace

tl::expected<ChildOutput, std::string> runProgram(const std::vector<std::string>& command) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return tl::unexpected(std::string(std::strerror(errno)));
  pid_t child = 0;
  const int error = start(command, ends[1], child);
  ::close(ends[1]);
  if (error != 0) {
    ::close(ends[0]);
    return tl::unexpected(fmt::format("cannot run {}: {}", command[0], std::strerror(error)));
  }
  ChildOutput output;
  const bool complete = readAll(ends[0], output.text);
  ::close(ends[0]);
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!complete) return tl::unexpected(fmt::format("{} prints too much", command[0]));
  output.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : kSignalBase + WTERMSIG(status);
  return output;
}

}  // namespace clothstream::cli
