// SPDX-License-Identifier: MIT
// The endpoint for operators while the program starts, serves and stops.
#pragma once

#include <memory>

#include "server/monitoring/monitoring_endpoint.h"
#include "server/options/program_options.h"

namespace clothstream::program {

// Opens the endpoint for operators, before the scenes are loaded, and prints its address. Null without
// --metrics-port.
std::unique_ptr<monitoring::MonitoringEndpoint> openMonitoring(const ServeOptions& options);

// Makes a server visible to the monitoring endpoint while the object lives.
class Monitored {
 public:
  // `endpoint` may be null.
  Monitored(monitoring::MonitoringEndpoint* endpoint, hosting::SceneServer& server);
  ~Monitored();
  Monitored(const Monitored&) = delete;
  Monitored& operator=(const Monitored&) = delete;

  void stopping() const;

 private:
  monitoring::MonitoringEndpoint* const endpoint_;
};

}  // namespace clothstream::program
