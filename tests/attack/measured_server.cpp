// SPDX-License-Identifier: MIT
#include "tests/attack/measured_server.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace clothstream::attack {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kStartTime{60};

std::vector<std::string> commandOf(const std::string& program, const std::vector<std::string>& arguments) {
  std::vector<std::string> command{program, "--port", "0", "--grpc-port", "0", "--log-level", "off"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return command;
}

std::uint64_t entriesIn(const std::string& folder) {
  return static_cast<std::uint64_t>(
      std::distance(std::filesystem::directory_iterator(folder), std::filesystem::directory_iterator()));
}

}  // namespace

MeasuredServer::MeasuredServer(const std::string& program, const std::vector<std::string>& arguments)
    : process_(commandOf(program, arguments)) {
  const auto page = process_.waitForLine("page ", kStartTime),
             grpc = process_.waitForLine("gRPC ", kStartTime);
  if (!page || !grpc) throw std::runtime_error("the server did not start: " + process_.errors());
  const auto hostOf = [](const std::string& line) {
    const std::size_t host = line.find("//") + 2;
    return line.substr(host, line.find('/', host) - host);
  };
  web_ = hostOf(*page);
  // This line comes before those of the endpoints.
  if (const std::size_t at = process_.output().find("metrics http"); at != std::string::npos)
    metrics_ = hostOf(process_.output().substr(at));
  grpc_ = grpc->substr(grpc->find_first_not_of(' '));
}

double MeasuredServer::memory(const std::string& key) const {
  std::ifstream status(folder() + "/status");
  for (std::string word; status >> word;)
    if (double kilobytes = 0; word == key + ":" && status >> kilobytes) return kilobytes * 1024 / 1e6;
  return 0;
}

void MeasuredServer::forgetPeak() {
  std::ofstream(folder() + "/clear_refs") << 5;  // resets VmHWM
}

std::uint64_t MeasuredServer::descriptors() const {
  return entriesIn(folder() + "/fd");
}

std::uint64_t MeasuredServer::threads() const {
  return entriesIn(folder() + "/task");
}

std::optional<double> MeasuredServer::end(std::chrono::seconds timeout) {
  process_.signal(SIGTERM);
  const auto asked = Clock::now();
  if (process_.waitForEnd(timeout) != 0) return std::nullopt;
  return std::chrono::duration<double>(Clock::now() - asked).count();
}

bool MeasuredServer::runs() {
  return !process_.waitForEnd(std::chrono::milliseconds(0));
}

}  // namespace clothstream::attack
