// SPDX-License-Identifier: MIT
// A socket belongs to the io_context, which runs on the thread; sending is posted to it.
#include "clients/datagram/udp_socket.h"

#include <algorithm>
#include <array>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/post.hpp>

namespace clothstream {
namespace {

namespace net = boost::asio;
using Udp = net::ip::udp;

// A burst of frames must fit.
constexpr int kReceiveBufferBytes = 1 << 20;

ice::Address addressOf(const Udp::endpoint& endpoint) {
  const net::ip::address& address = endpoint.address();
  if (address.is_v4()) return ice::Address::ofIpv4(address.to_v4().to_bytes(), endpoint.port());
  return {.bytes = address.to_v6().to_bytes(), .port = endpoint.port()};
}

}  // namespace

std::optional<ice::Address> readAddress(const std::string& text, std::uint16_t port) {
  boost::system::error_code malformed;
  const net::ip::address address = net::ip::make_address(text, malformed);
  if (malformed) return std::nullopt;
  return addressOf({address, port});
}

class UdpThread::Impl {
 public:
  Impl() : thread_([this] { io.run(); }) {}
  ~Impl() {
    work_.reset();
    thread_.join();
  }

  net::io_context io;

 private:
  net::executor_work_guard<net::io_context::executor_type> work_ = net::make_work_guard(io);
  std::thread thread_;
};

UdpThread::UdpThread() = default;

UdpThread::~UdpThread() = default;

UdpThread::Impl& UdpThread::started() {
  std::call_once(once_, [this] { impl_ = std::make_unique<Impl>(); });
  return *impl_;
}

// Its handlers keep it.
class UdpSocket::Impl : public std::enable_shared_from_this<Impl> {
 public:
  Impl(net::io_context& io, std::function<void()> onArrival)
      : io_(io), onArrival_(std::move(onArrival)), socket_(io) {
    open();
    socket_.non_blocking(true);
    boost::system::error_code ignored;
    socket_.set_option(net::socket_base::receive_buffer_size(kReceiveBufferBytes), ignored);
    port_ = socket_.local_endpoint().port();
  }

  void start() {
    net::post(io_, [self = shared_from_this()] { self->receive(); });
  }
  void close() {
    std::promise<void> closed;
    net::post(io_, [&] {
      boost::system::error_code ignored;
      socket_.close(ignored);
      onArrival_ = nullptr;
      closed.set_value();
    });
    closed.get_future().wait();
  }

  std::uint16_t port() const { return port_; }

  void send(const ice::Address& to, std::span<const std::byte> datagram) {
    net::post(io_, [self = shared_from_this(), endpoint = endpointOf(to),
                    bytes = std::vector<std::byte>(datagram.begin(), datagram.end())] {
      boost::system::error_code lost;
      self->socket_.send_to(net::buffer(bytes), endpoint, 0, lost);
    });
  }

  std::vector<ReceivedDatagram> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(arrived_, {});
  }

 private:
  void open() {
    boost::system::error_code noIpv6;
    socket_.open(Udp::v6(), noIpv6);
    if (!noIpv6) socket_.set_option(net::ip::v6_only(false), noIpv6);
    if (!noIpv6) socket_.bind({Udp::v6(), 0}, noIpv6);
    isIpv4_ = static_cast<bool>(noIpv6);
    if (!isIpv4_) return;
    socket_.close(noIpv6);
    socket_.open(Udp::v4());
    socket_.bind({Udp::v4(), 0});
  }

  Udp::endpoint endpointOf(const ice::Address& address) const {
    const net::ip::address_v6 ipv6(address.bytes);
    if (isIpv4_ && address.isIpv4())
      return {net::ip::make_address_v4(net::ip::v4_mapped, ipv6), address.port};
    return {ipv6, address.port};
  }

  void receive() {
    socket_.async_receive_from(
        net::buffer(buffer_), from_,
        [self = shared_from_this()](const boost::system::error_code& failed, std::size_t bytes) {
          if (!self->socket_.is_open()) return;
          // A failure reports that an earlier datagram could not be delivered.
          if (!failed) self->keep(std::span(self->buffer_).first(bytes));
          self->receive();
        });
  }

  void keep(std::span<const std::byte> datagram) {
    {
      const std::lock_guard lock(mutex_);
      if (arrived_.size() == kMaxWaiting) return;
      arrived_.push_back({addressOf(from_), {datagram.begin(), datagram.end()}});
    }
    onArrival_();
  }

  net::io_context& io_;
  std::function<void()> onArrival_;  // empty once the socket is closed
  Udp::socket socket_;
  bool isIpv4_ = false;
  std::uint16_t port_ = 0;
  std::array<std::byte, kMaxBytes> buffer_;
  Udp::endpoint from_;
  std::mutex mutex_;
  std::vector<ReceivedDatagram> arrived_;  // guarded by the mutex
};

UdpSocket::UdpSocket(UdpThread& thread, std::function<void()> onArrival)
    : impl_(std::make_shared<Impl>(thread.started().io, std::move(onArrival))) {
  impl_->start();
}

UdpSocket::~UdpSocket() {
  impl_->close();
}

std::uint16_t UdpSocket::port() const {
  return impl_->port();
}

void UdpSocket::send(const ice::Address& to, std::span<const std::byte> datagram) {
  impl_->send(to, datagram);
}

std::vector<ReceivedDatagram> UdpSocket::take() {
  return impl_->take();
}

}  // namespace clothstream
