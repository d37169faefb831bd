// SPDX-License-Identifier: MIT
// Metrics of the process, the server and its scenes as families of Prometheus (docs/monitoring.md).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <prometheus/metric_family.h>

#include "server/hosting/scene_server.h"
#include "server/scene/live_scene.h"

namespace clothstream::monitoring {

using Families = std::vector<prometheus::MetricFamily>;

// Version, and the resources of this process. `device` is empty while there is none.
Families programFamilies(const std::string& version, const std::string& device);
Families serverFamilies(const hosting::SceneServer& server);
// Every family is present, also without scenes. A histogram has samples for scenes that recorded something.
Families sceneFamilies(const std::vector<std::shared_ptr<scene::LiveScene>>& scenes);

}  // namespace clothstream::monitoring
