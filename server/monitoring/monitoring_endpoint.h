// SPDX-License-Identifier: MIT
// Endpoint for operators: metrics for Prometheus, health and readiness over HTTP.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace clothstream::hosting {
class SceneServer;
}

namespace clothstream::monitoring {

struct MonitoringOptions {
  std::string host = "127.0.0.1";
  std::uint16_t port = 0;  // 0: a free port
  std::string version{};   // of the server, for the metrics
  // Names in addition to those of this machine and to addresses. Requests for other names are answered with
  // 421 (endpoint::HostNames).
  std::vector<std::string> publicNames{};
  // The server is unhealthy if its device thread has not answered for this long. The thread is asked five
  // times in this time.
  std::chrono::milliseconds deviceSilence{5'000};
  // Metrics that were built less than this time ago are served again, because building them takes locks of
  // all scenes. 0: they are built for each request.
  std::chrono::milliseconds metricsLifetime{200};
};

// Answers GET and HEAD for these paths, one request per connection. Of many open connections the oldest ends
// (ConnectionRoom).
//   /metrics  metrics in the text format of Prometheus
//   /healthz  200, or 503 with the reason if the device thread does not answer. 200 without a server.
//   /readyz   200 while the server accepts clients, else 503 with the reason
//   /trace    spans of the scenes' newest seconds (traceEvents); /trace?seconds=N, 1 to 60, default 5
//
// Has one thread for all sockets. Create and destroy the endpoint on one thread.
class MonitoringEndpoint {
 public:
  // Listens when it returns; the server is starting. Throws std::runtime_error with advice if the port is in
  // use or the host is not an address of this machine.
  explicit MonitoringEndpoint(const MonitoringOptions& options);
  ~MonitoringEndpoint();
  MonitoringEndpoint(const MonitoringEndpoint&) = delete;
  MonitoringEndpoint& operator=(const MonitoringEndpoint&) = delete;

  // Port on which the endpoint listens.
  std::uint16_t port() const;

  // The server accepts clients, and its first scene is loaded.
  void started(hosting::SceneServer& server);
  // The server stops. Its metrics are still served.
  void stopping();
  // The server is not used any more after the return.
  void stopped();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::monitoring
