// SPDX-License-Identifier: MIT
#include "server/program/monitoring.h"

#include <cstdio>

#include <fmt/format.h>

#include "server/program/addresses.h"

namespace clothstream::program {

std::unique_ptr<monitoring::MonitoringEndpoint> openMonitoring(const ServeOptions& options) {
  if (!options.metrics.port) return nullptr;
  auto endpoint = std::make_unique<monitoring::MonitoringEndpoint>(
      monitoring::MonitoringOptions{.host = options.metrics.host,
                                    .port = *options.metrics.port,
                                    .version = CLOTHSTREAM_VERSION,
                                    .publicNames = options.network.publicNames});
  fmt::print("metrics http://{}/metrics\n", localAddress(options.metrics.host, endpoint->port()));
  std::fflush(stdout);
  return endpoint;
}

Monitored::Monitored(monitoring::MonitoringEndpoint* endpoint, hosting::SceneServer& server)
    : endpoint_(endpoint) {
  if (endpoint_ != nullptr) endpoint_->started(server);
}

Monitored::~Monitored() {
  if (endpoint_ != nullptr) endpoint_->stopped();
}

void Monitored::stopping() const {
  if (endpoint_ != nullptr) endpoint_->stopping();
}

}  // namespace clothstream::program
