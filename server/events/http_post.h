// SPDX-License-Identifier: MIT
// POST requests to one URL, with or without TLS.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>

#include "server/events/url.h"

namespace clothstream::events {

struct PostTimeouts {
  std::chrono::milliseconds connect{5'000};  // TLS included; the lookup of the name is not
  std::chrono::milliseconds answer{10'000};
};

// Belongs to the thread that runs the io_context, which must outlive it. With https, the certificate of the
// receiver must be of an authority that the system trusts. Redirections are not followed. Only the header of
// an answer is read, at most 8 KiB.
class HttpPost {
 public:
  using Headers = std::vector<std::pair<std::string, std::string>>;
  struct Answer {
    unsigned status = 0;  // 0: there was no answer
    std::string problem;  // why there was none
  };
  using Done = std::function<void(const Answer&)>;

  HttpPost(boost::asio::io_context& io, Url url, PostTimeouts timeouts);
  ~HttpPost();
  HttpPost(const HttpPost&) = delete;
  HttpPost& operator=(const HttpPost&) = delete;

  // Opens a connection for this request. `done` is called once by the io_context, and not before the return,
  // unless the io_context stops first.
  void send(const Headers& headers, std::string body, Done done);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::events
