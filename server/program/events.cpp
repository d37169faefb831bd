// SPDX-License-Identifier: MIT
#include "server/program/events.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <string>

#include <spdlog/spdlog.h>
#include <unistd.h>

#include "server/events/url.h"
#include "server/events/webhook.h"

namespace clothstream::program {
namespace {

// Name of the machine, in Kubernetes that of the pod.
std::string hostName() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "";
}

}  // namespace

std::shared_ptr<events::Events> openEvents(const ServeOptions& options) {
  if (options.webhook.url.empty()) return nullptr;
  const events::Url url = *events::parseUrl(options.webhook.url);
  if (!url.encrypted && !isLoopback(url.host))
    spdlog::warn("--events-url: everyone on the way to {} can read the events; use https://", url.authority);
  events::EventsOptions eventsOptions{.sender = {.url = url,
                                                 .key = events::readSecret(options.webhook.secret),
                                                 .server = hostName(),
                                                 .agent = kServerName}};
  // States of scenes need a part of the time in which the server must end.
  constexpr int kPartOfDrain = 3;
  eventsOptions.patience = std::min(eventsOptions.patience, options.server.drain / kPartOfDrain);
  return std::make_shared<events::Events>(std::move(eventsOptions));
}

}  // namespace clothstream::program
