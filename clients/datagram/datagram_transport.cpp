// SPDX-License-Identifier: MIT
// The stream does the waiting: the socket's thread wakes it.
#include "clients/datagram/datagram_transport.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "clients/datagram/datagram_session.h"

namespace clothstream {
namespace {

using namespace std::chrono_literals;

using SteadyClock = std::chrono::steady_clock;

class DatagramTransport final : public Transport {
 public:
  DatagramTransport(std::unique_ptr<Transport> stream, bool required)
      : stream_(std::move(stream)), required_(required), datagrams_(host_, [this] { stream_->wake(); }) {}

  void connect(const std::string& server) override {
    datagrams_.connecting();
    stream_->connect(server);
  }
  void prepare(const std::string& server) override { stream_->prepare(server); }
  bool active() const override { return stream_->active(); }
  bool hasOpened() const override { return stream_->hasOpened(); }
  bool canWrite() const override { return stream_->canWrite(); }
  void write(std::span<const std::byte> message) override {
    if (!datagrams_.sends(message)) stream_->write(message);
  }
  void leave() override {
    datagrams_.close();
    stream_->leave();
  }
  void cancel() override {
    datagrams_.close();
    stream_->cancel();
  }

  std::string serverAddress() const override { return stream_->serverAddress(); }
  void negotiate(cs_client& client) override {
    datagrams_.negotiate(client, [this] { return stream_->serverAddress(); });
  }
  std::optional<Missing> missing() const override {
    if (!required_ || datagrams_.hasOpened()) return std::nullopt;
    return Missing{.text = "Datagrams are required, but not open: " + datagrams_.why() +
                           ". Where they are not required, everything travels on the stream.",
                   .isFinal = datagrams_.isRefused()};
  }
  std::optional<cs_datagram_statistics> datagrams() const override {
    return datagrams_.hasOpened() ? std::optional(datagrams_.statistics()) : std::nullopt;
  }

  void wait(SteadyClock::duration atMost) override {
    exchange();
    const auto now = SteadyClock::now(), due = datagrams_.dueTime();
    // A message that is due for the stream stays due until the stream can be written.
    const SteadyClock::duration least = stream_->canWrite() ? 0ms : 1ms;
    const auto untilDue = due > now + least ? due - now : least;
    stream_->wait(std::exchange(hasMore_, false) ? SteadyClock::duration::zero()
                                                 : std::min(atMost, untilDue));
    exchange();
  }
  std::optional<std::span<const std::byte>> receive() override {
    auto message = datagrams_.nextMessage();
    if (!message) {
      message = stream_->receive();
      // A frame of the datagrams may have waited for this message.
      if (message && datagrams_.holds(*message)) message = datagrams_.nextMessage();
    }
    hasMore_ = message.has_value();
    return message;
  }
  void wake() override { stream_->wake(); }

  bool endedByServer() const override { return stream_->endedByServer(); }
  Failure notJoined() const override { return stream_->notJoined(); }
  Failure lost() const override { return stream_->lost(); }

 private:
  void exchange() {
    datagrams_.exchange();
    if (!stream_->canWrite()) return;
    if (const auto message = datagrams_.nextStreamMessage()) stream_->write(*message);
  }

  const std::unique_ptr<Transport> stream_;
  const bool required_;
  DatagramHost host_;
  DatagramSession datagrams_;
  bool hasMore_ = false;  // receive() may return another message without waiting
};

}  // namespace

std::unique_ptr<Transport> withDatagrams(std::unique_ptr<Transport> stream, Datagrams use) {
  if (use == Datagrams::off) return stream;
  return std::make_unique<DatagramTransport>(std::move(stream), use == Datagrams::required);
}

}  // namespace clothstream
