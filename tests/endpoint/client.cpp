// SPDX-License-Identifier: MIT
#include "tests/endpoint/client.h"

#include <utility>

namespace clothstream::tests {

bool Client::watch(Viewer& viewer, const std::function<bool()>& done) {
  while (!done()) {
    const std::optional<std::string> message = receive();
    if (!message) return false;
    if (const std::optional<std::string> answer = viewer.receive(*message)) send(*answer);
  }
  return true;
}

Joined::Joined(std::unique_ptr<Client> newClient, const std::string& scene) : client(std::move(newClient)) {
  client->send(hello(scene));
  see(1);
}

bool Joined::see(std::uint64_t count) {
  const std::uint64_t target = viewer.frames + count;
  return seeUntil([&] { return viewer.frames >= target; });
}

StreamEnd Joined::seeEnd() {
  seeUntil([] { return false; });
  return client->end();
}

}  // namespace clothstream::tests
