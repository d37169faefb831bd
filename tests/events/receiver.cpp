// SPDX-License-Identifier: MIT
#include "tests/events/receiver.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include <boost/asio/ip/address_v4.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <sys/socket.h>

namespace clothstream::tests {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using asio::ip::tcp;
using boost::system::error_code;

std::string lower(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

}  // namespace

Receiver::Receiver(Answers answers, std::uint16_t port, std::size_t answerBytes)
    : answers_(std::move(answers)),
      answerBytes_(answerBytes),
      acceptor_(io_, tcp::endpoint(asio::ip::address_v4::loopback(), port)),
      port_(acceptor_.local_endpoint().port()),
      thread_([this] { run(); }) {}

Receiver::~Receiver() {
  // Wakes the thread, which is accepting.
  ::shutdown(acceptor_.native_handle(), SHUT_RDWR);
  thread_.join();
}

void Receiver::run() {
  for (;;) {
    error_code error;
    Socket socket = acceptor_.accept(error);
    if (error) return;
    serve(std::move(socket));
  }
}

void Receiver::serve(Socket socket) {
  boost::beast::flat_buffer buffer;
  http::request<http::string_body> request;
  error_code error;
  http::read(socket, buffer, request, error);
  if (error) return;
  ReceivedRequest received{.target = std::string(request.target()), .body = request.body(), .headers = {}};
  for (const auto& field : request)
    received.headers[lower(std::string(field.name_string()))] = std::string(field.value());
  std::size_t number = 0;
  {
    const std::lock_guard lock(mutex_);
    number = requests_.size();
    requests_.push_back(std::move(received));
  }
  const int status = answers_(number);
  if (status == kClose) return;
  if (status == kNoAnswer) {
    unanswered_.push_back(std::move(socket));
    return;
  }
  http::response<http::string_body> response(static_cast<http::status>(status), request.version());
  if (response.result() != http::status::no_content) response.body() = std::string(answerBytes_, 'x');
  response.prepare_payload();
  http::write(socket, response, error);
}

std::vector<ReceivedRequest> Receiver::requests() const {
  const std::lock_guard lock(mutex_);
  return requests_;
}

}  // namespace clothstream::tests
