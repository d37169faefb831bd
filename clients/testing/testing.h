/* SPDX-License-Identifier: MIT
 * clothstream-server in tests with GoogleTest: a scene that is simulated, or a recording that is played.
 * Header only, C++17, for Linux and other systems with POSIX. Needs GoogleTest and libclothstream.
 *
 *   class Curtain : public clothstream::testing::ServerTest {};
 *   TEST_F(Curtain, HangsStill) {
 *     play("curtain.mcap");
 *     clothstream_stream* stream = nullptr;
 *     ASSERT_EQ(clothstream_open(address().c_str(), nullptr, &stream), CLOTHSTREAM_OK);
 *
 * The program is the one that the environment variable CLOTHSTREAM_SERVER names, else clothstream-server in
 * PATH. docs/testing-with-recordings.md explains the whole way. */
#ifndef CLOTHSTREAM_CLIENTS_TESTING_TESTING_H
#define CLOTHSTREAM_CLIENTS_TESTING_TESTING_H

#include <array>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

extern char** environ;

namespace clothstream {
namespace testing {

// How a recording is played (`clothstream-server play --help`).
struct PlayOptions {
  // The server sends the next frame when every client has acknowledged the last one. Then a client misses no
  // frame.
  bool lockstep = true;
  // Recorded seconds per second, 0.1 to 8. 0: as fast as clients acknowledge, only in lockstep.
  double speed = 0;
  // Clients that must be there before the first frame. At least 1.
  unsigned waitFor = 1;
  // Seed of dropped and delayed frames. Unset: none.
  std::optional<std::uint32_t> faults;
  // Further arguments of clothstream-server.
  std::vector<std::string> arguments;
};

// A running clothstream-server on free ports of 127.0.0.1. Belongs to one thread.
class Server {
 public:
  using Milliseconds = std::chrono::milliseconds;

  // Starts the program and returns when clients can connect. Throws std::runtime_error with the log if it
  // ends before, or does not start within `startTimeout`.
  explicit Server(const std::vector<std::string>& arguments,
                  Milliseconds startTimeout = Milliseconds(60000)) {
    std::vector<std::string> words{program(), "--port", "0", "--grpc-port", "0"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    start(words);
    reader_ = std::thread([this] { read(); });
    std::unique_lock<std::mutex> lock(mutex_);
    const bool done = changed_.wait_for(lock, startTimeout, [this] { return ended_ || hasAddresses(); });
    if (hasAddresses()) {
      address_ = wordAfter("page    ");
      grpcAddress_ = wordAfter("gRPC    ");
      return;
    }
    lock.unlock();
    stop(Milliseconds(0));
    throw std::runtime_error(words.front() + (done ? " ended" : " printed no address in time") +
                             "; set CLOTHSTREAM_SERVER to the program. Its log:\n" + log());
  }
  static std::unique_ptr<Server> playing(const std::string& recording, const PlayOptions& options = {}) {
    std::vector<std::string> arguments{"play", recording};
    if (options.lockstep) arguments.push_back("--lockstep");
    arguments.insert(arguments.end(), {"--speed", options.speed > 0 ? std::to_string(options.speed) : "max"});
    arguments.insert(arguments.end(), {"--wait-for", std::to_string(options.waitFor)});
    if (options.faults) arguments.insert(arguments.end(), {"--faults", std::to_string(*options.faults)});
    arguments.insert(arguments.end(), options.arguments.begin(), options.arguments.end());
    return std::make_unique<Server>(arguments);
  }
  ~Server() { stop(); }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Address for clothstream_open, such as "http://127.0.0.1:41234/"; that of the page, too.
  const std::string& address() const { return address_; }
  const std::string& grpcAddress() const { return grpcAddress_; }

  // Output of the program so far: standard output and standard error.
  std::string log() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return log_;
  }

  // Sends a signal, for example SIGKILL for a server that crashes. Requires that stop() was not called.
  void signal(int number) { ::kill(pid_, number); }

  // Ends the program with SIGTERM, and with SIGKILL if it still runs after `timeout`. Returns its exit code,
  // or the negative number of the signal that ended it.
  int stop(Milliseconds timeout = Milliseconds(15000)) {
    if (pid_ <= 0) return exitCode_;
    ::kill(pid_, SIGTERM);
    {
      // The output ends with the program.
      std::unique_lock<std::mutex> lock(mutex_);
      if (!changed_.wait_for(lock, timeout, [this] { return ended_; })) ::kill(pid_, SIGKILL);
    }
    reader_.join();
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    ::close(pipe_);
    pid_ = -1;
    return exitCode_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

 private:
  static std::string program() {
    const char* const named = std::getenv("CLOTHSTREAM_SERVER");
    return named != nullptr && *named != '\0' ? named : "clothstream-server";
  }

  void start(std::vector<std::string>& words) {
    std::array<int, 2> ends{};
    if (::pipe(ends.data()) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
    for (const int end : ends) ::fcntl(end, F_SETFD, FD_CLOEXEC);
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
    ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(&word[0]);
    arguments.push_back(nullptr);
    const int error =
        ::posix_spawnp(&pid_, words.front().c_str(), &actions, nullptr, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(ends[1]);
    pipe_ = ends[0];
    if (error == 0) return;
    ::close(pipe_);
    pid_ = -1;
    throw std::runtime_error(words.front() + " cannot be started: " + std::generic_category().message(error) +
                             "; set CLOTHSTREAM_SERVER to the program");
  }

  // Keeps the program's pipe empty, so that it never waits for the test.
  void read() {
    std::array<char, 4096> buffer{};
    for (;;) {
      const ssize_t count = ::read(pipe_, buffer.data(), buffer.size());
      if (count < 0 && errno == EINTR) continue;
      const std::lock_guard<std::mutex> lock(mutex_);
      if (count > 0)
        log_.append(buffer.data(), static_cast<std::size_t>(count));
      else
        ended_ = true;
      changed_.notify_all();
      if (count <= 0) return;
    }
  }

  // Both need the mutex.
  bool hasAddresses() const { return !wordAfter("page    ").empty() && !wordAfter("gRPC    ").empty(); }
  // Rest of the line that begins with `start`; "" before the line is complete.
  std::string wordAfter(const std::string& start) const {
    const std::size_t at = ("\n" + log_).find("\n" + start);
    const std::size_t end = at == std::string::npos ? at : log_.find('\n', at);
    return end == std::string::npos ? std::string() : log_.substr(at + start.size(), end - at - start.size());
  }

  pid_t pid_ = -1;
  int pipe_ = -1, exitCode_ = 0;
  std::string address_, grpcAddress_;
  mutable std::mutex mutex_;  // protects what follows
  std::condition_variable changed_;
  std::string log_;
  bool ended_ = false;
  std::thread reader_;
};

// Fixture with one server per test. The server ends after the test; if the test has failed, its log is
// printed.
class ServerTest : public ::testing::Test {
 protected:
  // Simulates scenes with these arguments of clothstream-server, such as {"--scene", "curtain"}. Needs a
  // Vulkan device.
  void serve(const std::vector<std::string>& arguments) {
    stopServer();
    server_ = std::make_unique<Server>(arguments);
  }
  // Plays a recording. Needs no device.
  void play(const std::string& recording, const PlayOptions& options = {}) {
    stopServer();
    server_ = Server::playing(recording, options);
  }
  // Requires serve() or play().
  Server& server() { return *server_; }
  const std::string& address() const { return server_->address(); }

  void stopServer() {
    if (!server_) return;
    const int code = server_->stop();
    EXPECT_EQ(code, 0)
        << "clothstream-server ended with this exit code, or the negative number of this signal";
    if (HasFailure()) std::cerr << "Log of clothstream-server:\n" << server_->log();
    server_.reset();
  }
  void TearDown() override { stopServer(); }

 private:
  std::unique_ptr<Server> server_;
};

}  // namespace testing
}  // namespace clothstream

#endif
