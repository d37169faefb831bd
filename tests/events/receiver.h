// SPDX-License-Identifier: MIT
// Stand-in of a backend: keeps the requests that it gets, and answers them as the test says.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>

namespace clothstream::tests {

struct ReceivedRequest {
  std::string target, body;
  std::map<std::string, std::string> headers;  // names in lower case
};

// Serves one connection at a time.
class Receiver {
 public:
  // In place of a status: the connection is closed, or left without an answer until the end of the receiver.
  static constexpr int kClose = 0, kNoAnswer = -1;
  // Status for the request of this number, from 0.
  using Answers = std::function<int(std::size_t)>;

  // Port 0 picks a free one. Answers have a body of this size.
  explicit Receiver(
      Answers answers = [](std::size_t) { return 200; }, std::uint16_t port = 0, std::size_t answerBytes = 2);
  ~Receiver();
  Receiver(const Receiver&) = delete;
  Receiver& operator=(const Receiver&) = delete;

  std::uint16_t port() const { return port_; }
  std::vector<ReceivedRequest> requests() const;

 private:
  using Socket = boost::asio::ip::tcp::socket;
  void run();
  void serve(Socket socket);

  const Answers answers_;
  const std::size_t answerBytes_;
  boost::asio::io_context io_;
  boost::asio::ip::tcp::acceptor acceptor_;
  const std::uint16_t port_;
  std::list<Socket> unanswered_;

  mutable std::mutex mutex_;  // protects the requests
  std::vector<ReceivedRequest> requests_;

  std::thread thread_;
};

}  // namespace clothstream::tests
