// SPDX-License-Identifier: MIT
// Debian's nats-server on a free port of this machine.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "tests/e2e/process.h"

namespace clothstream::tests {

class NatsServer {
 public:
  // Nothing if there is no nats-server.
  static std::unique_ptr<NatsServer> start();
  ~NatsServer();

  std::string url() const;
  // Ends it at once, without a goodbye.
  void kill();
  // Starts it again on the same port.
  void restart();

 private:
  explicit NatsServer(std::filesystem::path program);
  void run(const std::string& port);

  std::filesystem::path program_;
  std::filesystem::path directory_;
  std::string port_;
  std::unique_ptr<e2e::Process> process_;
};

}  // namespace clothstream::tests
