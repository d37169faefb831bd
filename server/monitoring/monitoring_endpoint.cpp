// SPDX-License-Identifier: MIT
#include "server/monitoring/monitoring_endpoint.h"

#include <charconv>
#include <cstddef>
#include <exception>
#include <iterator>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <utility>
#include <vector>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <fmt/format.h>
#include <prometheus/text_serializer.h>
#include <spdlog/spdlog.h>

#include "server/endpoint/listen/listen.h"
#include "server/hosting/scene_server.h"
#include "server/monitoring/http_connection.h"
#include "server/monitoring/metric_families.h"
#include "server/monitoring/trace_events.h"
#include "server/telemetry/thread_name.h"

namespace clothstream::monitoring {
namespace {

namespace net = boost::asio;
namespace http = boost::beast::http;
using net::ip::tcp;
using namespace std::chrono_literals;

constexpr auto kAcceptPause = 100ms;
constexpr int kTraceSeconds = 5, kMostTraceSeconds = 60;
constexpr int kProbes = 5;  // of the device thread in MonitoringOptions::deviceSilence

void append(Families& families, Families more) {
  families.insert(families.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

// Seconds of a request for /trace; empty if the query asks for something else.
std::optional<int> traceSeconds(std::string_view query) {
  constexpr std::string_view kName = "?seconds=";
  if (query.empty()) return kTraceSeconds;
  if (!query.starts_with(kName)) return std::nullopt;
  query.remove_prefix(kName.size());
  int seconds = 0;
  const auto [end, error] = std::from_chars(query.data(), query.data() + query.size(), seconds);
  if (error != std::errc() || end != query.data() + query.size()) return std::nullopt;
  return seconds >= 1 && seconds <= kMostTraceSeconds ? std::optional(seconds) : std::nullopt;
}

}  // namespace

struct MonitoringEndpoint::State {
  enum class Phase : std::uint8_t { starting, serving, stopping };

  const std::string version;
  const std::chrono::milliseconds deviceSilence, metricsLifetime;

  std::mutex mutex;  // protects the next two
  Phase phase = Phase::starting;
  hosting::SceneServer* server = nullptr;

  // Belong to the thread. The context outlives the sockets, which are destroyed with `io`.
  HttpContext context;
  net::io_context io{1};
  net::executor_work_guard<net::io_context::executor_type> work{io.get_executor()};  // until io.stop()
  tcp::acceptor acceptor;
  net::steady_timer acceptTimer{io}, probeTimer{io};
  std::string metricsText;  // the newest
  std::optional<schedule::Clock::time_point> metricsBuilt;
  std::uint16_t port;
  std::thread thread;

  explicit State(const MonitoringOptions& options)
      : version(options.version),
        deviceSilence(options.deviceSilence),
        metricsLifetime(options.metricsLifetime),
        context{.names = endpoint::HostNames(options.publicNames),
                .answer = [this](std::string_view target) { return answer(target); }},
        acceptor(endpoint::listen(io, options.host, options.port, "--metrics-port")),
        port(acceptor.local_endpoint().port()) {
    accept();
    probe();
    thread = std::thread([this] { run(); });
  }

  ~State() {
    io.stop();
    thread.join();
  }

  // An exception, such as for /proc without a free descriptor, ends the handler of one socket and not the
  // endpoint.
  void run() {
    telemetry::nameThread("monitoring");
    for (;;) try {
        io.run();
        return;
      } catch (const std::exception& failure) {
        spdlog::error("metrics: {}", failure.what());
      }
  }

  void accept() {
    acceptor.async_accept([this](boost::system::error_code error, tcp::socket socket) {
      if (error) {  // such as no free descriptor; an immediate retry would only spin
        acceptTimer.expires_after(kAcceptPause);
        acceptTimer.async_wait([this](boost::system::error_code) { accept(); });
        return;
      }
      accept();  // first, so that it goes on if the connection fails
      std::make_shared<HttpConnection>(std::move(socket), context)->read();
    });
  }

  // Wakes the device thread, which otherwise sleeps while no scene runs.
  void probe() {
    {
      const std::lock_guard lock(mutex);
      if (server != nullptr) server->device.wake();
    }
    probeTimer.expires_after(deviceSilence / kProbes);
    probeTimer.async_wait([this](boost::system::error_code) { probe(); });
  }

  Answer answer(std::string_view target) {
    const std::lock_guard lock(mutex);
    const std::string_view path = target.substr(0, target.find('?'));
    if (path == "/metrics") return metrics();
    if (path == "/healthz") return health();
    if (path == "/readyz") return readiness();
    if (path == "/trace") return trace(traceSeconds(target.substr(path.size())));
    return {.status = http::status::not_found, .body = "There are /metrics, /healthz, /readyz and /trace.\n"};
  }

  Answer trace(std::optional<int> seconds) const {
    if (!seconds)
      return {
          .status = http::status::bad_request,
          .body = fmt::format("Use /trace or /trace?seconds=N with N from 1 to {}.\n", kMostTraceSeconds)};
    std::vector<std::shared_ptr<scene::LiveScene>> scenes;
    if (server != nullptr) scenes = server->scenes.all();
    return {.contentType = "application/json",
            .body = traceEvents(scenes, schedule::Clock::now() - std::chrono::seconds(*seconds))};
  }

  Answer metrics() {
    if (!metricsBuilt || schedule::Clock::now() - *metricsBuilt >= metricsLifetime) {
      metricsText = buildMetrics();
      metricsBuilt = schedule::Clock::now();
    }
    return {.contentType = "text/plain; version=0.0.4; charset=utf-8", .body = metricsText};
  }

  std::string buildMetrics() const {
    Families families = programFamilies(version, server != nullptr ? server->device.info().name : "");
    if (server != nullptr) {
      append(families, serverFamilies(*server));
      append(families, sceneFamilies(server->scenes.all()));
    }
    return prometheus::TextSerializer().Serialize(families);
  }

  Answer health() const {
    if (server == nullptr) return {.body = "ok\n"};
    const auto silence = schedule::Clock::now() - server->device.lastAnswer();
    if (silence <= deviceSilence) return {.body = "ok\n"};
    return {.status = http::status::service_unavailable,
            .body = fmt::format("The device thread has not answered for {:.1f} s. The log has the reason if "
                                "the device was lost.\n",
                                schedule::seconds(silence))};
  }

  Answer readiness() const {
    if (phase == Phase::serving) return {.body = "ok\n"};
    return {.status = http::status::service_unavailable,
            .body = phase == Phase::starting ? "The server is starting.\n" : "The server is stopping.\n"};
  }
};

MonitoringEndpoint::MonitoringEndpoint(const MonitoringOptions& options)
    : state_(std::make_unique<State>(options)) {}

MonitoringEndpoint::~MonitoringEndpoint() = default;

std::uint16_t MonitoringEndpoint::port() const {
  return state_->port;
}

void MonitoringEndpoint::started(hosting::SceneServer& server) {
  const std::lock_guard lock(state_->mutex);
  state_->phase = State::Phase::serving;
  state_->server = &server;
  server.device.wake();
}

void MonitoringEndpoint::stopping() {
  const std::lock_guard lock(state_->mutex);
  state_->phase = State::Phase::stopping;
}

void MonitoringEndpoint::stopped() {
  const std::lock_guard lock(state_->mutex);
  state_->phase = State::Phase::stopping;
  state_->server = nullptr;
}

}  // namespace clothstream::monitoring
