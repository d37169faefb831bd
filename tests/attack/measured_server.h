// SPDX-License-Identifier: MIT
// A server that a program starts on free ports and measures from outside.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/e2e/process.h"

namespace clothstream::attack {

// Belongs to one thread.
class MeasuredServer {
 public:
  // `program` is clothstream-server. Throws std::runtime_error if it does not start.
  MeasuredServer(const std::string& program, const std::vector<std::string>& arguments);

  const std::string& grpc() const { return grpc_; }  // HOST:PORT
  const std::string& web() const { return web_; }    // HOST:PORT
  // HOST:PORT of the endpoint for operators; empty without it.
  const std::string& metrics() const { return metrics_; }

  double megabytes() const { return memory("VmRSS"); }  // resident
  // Highest value of megabytes() since the last call of forgetPeak().
  double peakMegabytes() const { return memory("VmHWM"); }
  void forgetPeak();
  std::uint64_t descriptors() const;
  std::uint64_t threads() const;

  // Sends SIGTERM. Returns the seconds until the process ended with exit code 0, or nothing if it did not
  // within `timeout`.
  std::optional<double> end(std::chrono::seconds timeout);
  bool runs();
  e2e::Process& process() { return process_; }

 private:
  double memory(const std::string& key) const;
  std::string folder() const { return "/proc/" + std::to_string(process_.id()); }

  e2e::Process process_;
  std::string grpc_, web_, metrics_;
};

}  // namespace clothstream::attack
