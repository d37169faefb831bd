// SPDX-License-Identifier: MIT
// One thread serves all connections.
#include "tests/e2e/link.h"

#include <algorithm>
#include <array>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>

namespace clothstream::e2e {
namespace {

namespace net = boost::asio;
using boost::system::error_code;
using net::ip::tcp;
using Clock = std::chrono::steady_clock;

// Current impairment of the link. The jitter is the same in every run.
struct Conditions {
  Impairment impairment;
  bool whole = true;
  std::mt19937 random{1};
};

void reset(tcp::socket& socket) {
  error_code ignored;
  socket.set_option(net::socket_base::linger(true, 0), ignored);
  socket.close(ignored);
}

// The client's connection and the matching one to the server.
class Pair : public std::enable_shared_from_this<Pair> {
 public:
  Pair(Conditions& conditions, tcp::socket client, net::io_context& io)
      : conditions_(conditions),
        client_(std::move(client)),
        server_(io),
        pipes_{Pipe(client_, server_, io), Pipe(server_, client_, io)} {}

  void open(std::uint16_t target) {
    server_.async_connect({net::ip::address_v4::loopback(), target},
                          [self = shared_from_this()](error_code error) {
                            if (error || !self->isOpen_) return self->close();
                            self->isConnected_ = true;
                            for (Pipe& pipe : self->pipes_) {
                              pipe.to.set_option(tcp::no_delay(true));
                              self->read(pipe);
                            }
                          });
  }
  void close() {
    isOpen_ = false;
    reset(client_);
    reset(server_);
    for (Pipe& pipe : pipes_) pipe.timer.cancel();
  }
  bool isOpen() const { return isOpen_; }
  // Continues after the conditions have changed.
  void goOn() {
    for (Pipe& pipe : pipes_) {
      read(pipe);
      write(pipe);
    }
  }

 private:
  struct Pipe {
    struct Chunk {
      std::vector<char> bytes;
      Clock::time_point due;
    };

    tcp::socket &from, &to;
    net::steady_timer timer;
    std::array<char, 16 * 1024> incoming{};
    std::deque<Chunk> waiting{};
    std::size_t bytes = 0;  // that wait
    Clock::time_point free{}, lastDue{};
    bool reading = false, writing = false, ended = false;

    Pipe(tcp::socket& in, tcp::socket& out, net::io_context& io) : from(in), to(out), timer(io) {}
  };

  void read(Pipe& pipe) {
    const Impairment& now = conditions_.impairment;
    if (!isOpen_ || pipe.reading || pipe.ended || now.stalled || !isConnected_) return;
    if (pipe.bytes >= now.queueBytes) return;
    pipe.reading = true;
    pipe.from.async_read_some(net::buffer(pipe.incoming),
                              [self = shared_from_this(), &pipe](error_code error, std::size_t count) {
                                pipe.reading = false;
                                if (error)
                                  pipe.ended = true;
                                else
                                  self->queue(pipe, count);
                                self->write(pipe);
                                self->read(pipe);
                              });
  }

  void queue(Pipe& pipe, std::size_t count) {
    const Impairment& now = conditions_.impairment;
    pipe.free = std::max(pipe.free, Clock::now());
    if (now.bytesPerSecond > 0) {
      const std::chrono::duration<double> time(static_cast<double>(count) / now.bytesPerSecond);
      pipe.free += std::chrono::duration_cast<Clock::duration>(time);
    }
    std::uniform_int_distribution<std::int64_t> jitter(0, now.jitter.count());
    const auto due = pipe.free + now.delay + std::chrono::microseconds(jitter(conditions_.random));
    pipe.lastDue = std::max(pipe.lastDue, due);
    pipe.waiting.push_back(
        {{pipe.incoming.begin(), pipe.incoming.begin() + static_cast<std::ptrdiff_t>(count)}, pipe.lastDue});
    pipe.bytes += count;
  }

  void write(Pipe& pipe) {
    if (!isOpen_ || pipe.writing || conditions_.impairment.stalled) return;
    if (pipe.waiting.empty()) {
      if (pipe.ended) close();
      return;
    }
    pipe.writing = true;
    pipe.timer.expires_at(pipe.waiting.front().due);
    pipe.timer.async_wait([self = shared_from_this(), &pipe](error_code error) {
      if (error || self->conditions_.impairment.stalled) {
        pipe.writing = false;
        return;
      }
      net::async_write(pipe.to, net::buffer(pipe.waiting.front().bytes),
                       [self, &pipe](error_code failed, std::size_t count) {
                         pipe.writing = false;
                         if (failed) return self->close();
                         pipe.bytes -= count;
                         pipe.waiting.pop_front();
                         self->read(pipe);
                         self->write(pipe);
                       });
    });
  }

  Conditions& conditions_;
  tcp::socket client_, server_;
  std::array<Pipe, 2> pipes_;
  bool isOpen_ = true, isConnected_ = false;
};

}  // namespace

struct Link::State {
  explicit State(std::uint16_t to)
      : target(to),
        acceptor(io, {net::ip::address_v4::loopback(), 0}),
        port(acceptor.local_endpoint().port()),
        work(net::make_work_guard(io)) {
    accept();
    thread = std::thread([this] { io.run(); });
  }
  ~State() {
    net::post(io, [this] {
      closeAll();
      acceptor.close();
    });
    work.reset();
    thread.join();
  }

  void accept() {
    acceptor.async_accept([this](error_code error, tcp::socket client) {
      if (error) return;
      std::erase_if(pairs, [](const auto& pair) { return !pair->isOpen(); });
      if (conditions.whole) {
        pairs.push_back(std::make_shared<Pair>(conditions, std::move(client), io));
        pairs.back()->open(target);
      } else {
        reset(client);
      }
      accept();
    });
  }
  void closeAll() {
    for (const auto& pair : pairs) pair->close();
    pairs.clear();
  }
  // Fills the accept queue with connections that are never accepted. The kernel then drops new ones.
  void fillQueue() {
    acceptor.cancel();
    acceptor.listen(0);
    for (int i = 0; i < kFilling; ++i) {
      filling.emplace_back(io, tcp::v4());
      filling.back().async_connect({net::ip::address_v4::loopback(), port}, [](error_code) {});
    }
  }
  void emptyQueue() {
    filling.clear();
    acceptor.listen(net::socket_base::max_listen_connections);
    acceptor.non_blocking(true);
    error_code none;
    while (!none) {
      tcp::socket filled = acceptor.accept(none);
      if (!none) reset(filled);
    }
    accept();
  }
  // Runs `how` on the link's thread and returns when it is done.
  void change(const std::function<void()>& how) {
    std::promise<void> done;
    net::post(io, [&] {
      how();
      for (const auto& pair : pairs) pair->goOn();
      done.set_value();
    });
    done.get_future().get();
  }

  const std::uint16_t target;
  net::io_context io;
  tcp::acceptor acceptor;
  const std::uint16_t port;
  net::executor_work_guard<net::io_context::executor_type> work;
  Conditions conditions;
  std::vector<std::shared_ptr<Pair>> pairs;
  // The shortest queue takes one connection; the others find it full.
  static constexpr int kFilling = 3;
  std::vector<tcp::socket> filling;
  std::thread thread;
};

Link::Link(std::uint16_t target) : state_(std::make_unique<State>(target)) {}
Link::~Link() = default;

std::uint16_t Link::port() const {
  return state_->port;
}

void Link::impair(const Impairment& impairment) {
  state_->change([&] { state_->conditions.impairment = impairment; });
}

void Link::cut() {
  state_->change([&] {
    state_->conditions.whole = false;
    state_->closeAll();
  });
}

void Link::swallow() {
  state_->change([&] {
    state_->closeAll();
    state_->fillQueue();
  });
}

void Link::restore() {
  state_->change([&] {
    state_->conditions.whole = true;
    if (!state_->filling.empty()) state_->emptyQueue();
  });
}

}  // namespace clothstream::e2e
