// SPDX-License-Identifier: MIT
#include "tests/fleet/nats_server.h"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <utility>

#include <unistd.h>

#include "tests/support/eventually.h"

namespace clothstream::tests {
namespace {

// Path of nats-server, or an empty path if it is not installed. Debian installs it into /usr/sbin, which the
// PATH of a user may lack.
std::filesystem::path findNatsServer() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(std::string(path != nullptr ? path : "") + ":/usr/sbin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path program = std::filesystem::path(folder) / "nats-server";
    if (!folder.empty() && ::access(program.c_str(), X_OK) == 0) return program;
  }
  return {};
}

}  // namespace

std::unique_ptr<NatsServer> NatsServer::start() {
  const std::filesystem::path program = findNatsServer();
  return program.empty() ? nullptr : std::unique_ptr<NatsServer>(new NatsServer(program));
}

NatsServer::NatsServer(std::filesystem::path program) : program_(std::move(program)) {
  std::string name = std::filesystem::temp_directory_path() / "clothstream-nats-XXXXXX";
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary directory");
  directory_ = name;
  run("-1");  // a free one
}

NatsServer::~NatsServer() {
  process_.reset();
  std::filesystem::remove_all(directory_);
}

void NatsServer::run(const std::string& port) {
  std::filesystem::create_directories(directory_ / "ports");
  process_ = std::make_unique<e2e::Process>(std::vector<std::string>{
      program_.string(), "--addr", "127.0.0.1", "--port", port, "--ports_file_dir",
      (directory_ / "ports").string(), "--jetstream", "--store_dir", (directory_ / "store").string()});
  // It writes its address into a file: {"nats":["nats://127.0.0.1:39999"]}
  const auto portInFile = [&] {
    for (const auto& entry : std::filesystem::directory_iterator(directory_ / "ports")) {
      std::ifstream file(entry.path());
      const std::string text{std::istreambuf_iterator<char>(file), {}};
      const std::string before = "nats://127.0.0.1:";
      const std::size_t found = text.find(before);
      if (found == std::string::npos) continue;
      port_ = text.substr(found + before.size());
      port_ = port_.substr(0, port_.find('"'));
      return true;
    }
    return false;
  };
  if (!eventually(portInFile)) throw std::runtime_error("nats-server does not start: " + process_->errors());
}

std::string NatsServer::url() const {
  return "nats://127.0.0.1:" + port_;
}

void NatsServer::kill() {
  process_->signal(SIGKILL);
  process_->waitForEnd(std::chrono::seconds(10));
  std::filesystem::remove_all(directory_ / "ports");
}

void NatsServer::restart() {
  run(port_);
}

}  // namespace clothstream::tests
