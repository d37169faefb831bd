// SPDX-License-Identifier: MIT
#include "server/endpoint/datagram/datagram_endpoint.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <functional>
#include <thread>
#include <utility>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <spdlog/spdlog.h>

#include "proto/dtls/certificate.h"
#include "proto/dtls/digest.h"
#include "proto/dtls/dtls_context.h"
#include "server/endpoint/datagram/association_table.h"
#include "server/endpoint/datagram/shared_pieces.h"
#include "server/endpoint/datagram/udp_port.h"
#include "server/hosting/scene_server.h"
#include "server/session/wake.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::endpoint {
namespace {

namespace net = boost::asio;

// Addresses in an answer; clients check no more.
constexpr std::size_t kMaxAddresses = 8;

}  // namespace

struct DatagramEndpoint::State : std::enable_shared_from_this<State> {
  State(const DatagramEndpointOptions& given, telemetry::DatagramMetrics& metrics)
      : options(given),
        udp(io, given.host, given.port),
        port(udp.port()),
        table(
            {.dtls = context, .pieces = pieces, .metrics = metrics},
            [this](const Route& route, std::span<const std::byte> datagram) { udp.send(route, datagram); }) {
    udp.receive([this](const Route& route,
                       std::span<const std::byte> datagram) { table.handle(route, datagram, Clock::now()); },
                [this] { settle(); });
  }

  // An exception ends the handler of one event and not the endpoint.
  void run() {
    telemetry::nameThread("datagrams");
    for (;;) try {
        io.run();
        return;
      } catch (const std::exception& failure) {
        spdlog::error("datagrams: {}", failure.what());
      }
  }

  // Runs a function on the endpoint's thread, and then settle().
  template <typename Step>
  void post(Step step) {
    net::post(io, [this, step = std::move(step)]() mutable {
      step();
      settle();
    });
  }

  // Sends what associations have given, and sets the timer. A timer that is set too early stays: that costs
  // less than to set it again for each frame.
  void settle() {
    udp.flush();
    const Time due = table.nextTime();
    if (due >= timerSet) return;
    timerSet = due;
    timer.expires_at(due);
    timer.async_wait([this](boost::system::error_code cancelled) {
      if (cancelled) return;
      timerSet = Time::max();
      table.advance(Clock::now());
      settle();
    });
  }

  const DatagramEndpointOptions options;
  const dtls::Certificate certificate;
  const dtls::DtlsContext context{certificate};
  const dtls::Digest fingerprint = dtls::digestOf(certificate.fingerprint());
  net::io_context io{1};
  net::executor_work_guard<net::io_context::executor_type> work{io.get_executor()};  // until io.stop()
  UdpPort udp;
  const std::uint16_t port;
  SharedPieces pieces;
  AssociationTable table;
  net::steady_timer timer{io};
  Time timerSet = Time::max();
  std::atomic<std::size_t> peers{0};
  std::thread thread;
};

DatagramEndpoint::DatagramEndpoint(hosting::SceneServer& server, const DatagramEndpointOptions& options)
    : state_(std::make_shared<State>(options, server.metrics.datagrams)), server_(server) {
  state_->thread = std::thread([state = state_.get()] { state->run(); });
  server_.datagrams = this;
}

DatagramEndpoint::~DatagramEndpoint() {
  server_.datagrams = nullptr;
  State& state = *state_;
  net::post(state.io, [&state] {
    state.table.clear();
    state.udp.flush();
    state.udp.close();
    state.io.stop();
  });
  state.thread.join();
}

std::uint16_t DatagramEndpoint::port() const {
  return state_->port;
}

std::optional<hosting::DatagramGate::Opened> DatagramEndpoint::open(hosting::DatagramPeer peer) {
  State& state = *state_;
  ice::Credentials local = ice::randomCredentials();
  if (++state.peers > state.options.maxPeers) {
    --state.peers;
    spdlog::warn("{}: stays on its stream: {} peers have datagrams, the maximum", peer.name,
                 state.options.maxPeers);
    return std::nullopt;
  }
  Opened opened;
  opened.answer.set_ufrag(local.ufrag);
  opened.answer.set_password(local.password);
  opened.answer.set_fingerprint(state.fingerprint.data(), state.fingerprint.size());
  opened.answer.set_port(state.port);
  std::vector<std::string> addresses =
      peer.reached.empty() ? state.options.ownAddresses : std::vector{peer.reached};
  addresses.insert(addresses.end(), state.options.publicAddresses.begin(),
                   state.options.publicAddresses.end());
  auto& answered = *opened.answer.mutable_addresses();
  for (std::string& address : addresses)
    if (std::ranges::find(answered, address) == answered.end() &&
        static_cast<std::size_t>(answered.size()) < kMaxAddresses)
      *answered.Add() = std::move(address);

  opened.association = {static_cast<const void*>(this),
                        [weak = std::weak_ptr(state_), ufrag = local.ufrag](const void*) {
                          const std::shared_ptr<State> ended = weak.lock();
                          if (!ended) return;
                          --ended->peers;
                          ended->post([state = ended.get(), ufrag] { state->table.remove(ufrag); });
                        }};
  state.post([&state, local = std::move(local), peer = std::move(peer)]() mutable {
    auto wake = session::wakeOf(
        state.weak_from_this(), [&state](auto task) { state.post(std::move(task)); },
        [ufrag = local.ufrag](State& self) { self.table.wake(ufrag, Clock::now()); });
    state.table.add(std::move(local), std::move(peer), std::move(wake), Clock::now());
  });
  return opened;
}

}  // namespace clothstream::endpoint
