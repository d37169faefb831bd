// SPDX-License-Identifier: MIT
#include "clients/native/pairing.h"

#include <cassert>
#include <cstdint>
#include <memory>
#include <optional>

#include "clients/core/core.h"
#include "clients/native/native_client.h"

namespace clothstream {
namespace {

using Clock = std::chrono::steady_clock;
using Answer = tl::expected<std::string, Failure>;

// Returns nothing if the message is not the answer.
std::optional<Answer> answerIn(cs_client* core, std::span<const std::byte> message,
                               const ServerAddress& address) {
  const std::uint32_t events = cs_receive(core, reinterpret_cast<const std::uint8_t*>(message.data()),
                                          message.size(), NativeClient::nowUs());
  const auto refused = [](std::string text) {
    return Answer(tl::unexpected(Failure{Failure::Kind::refused, std::move(text)}));
  };
  if ((events & CS_EVENT_ERROR) != 0)
    return refused("The server at " + address.address + " refuses: " + cs_error_text(core));
  if ((events & CS_EVENT_TOKEN) != 0) return Answer(cs_token(core));
  // The answer of a server without pairing has no token.
  if (events == 0) return refused("The server at " + address.address + " needs no pairing.");
  return std::nullopt;
}

void sayGoodbye(Transport& transport) {
  const auto end = Clock::now() + kClosingTime;
  while (transport.active() && transport.hasOpened() && Clock::now() < end) {
    transport.leave();
    transport.wait(end - Clock::now());
    transport.receive();
  }
  if (transport.active()) transport.cancel();
}

}  // namespace

Answer pairOver(Transport& transport, const ServerAddress& address, const std::string& code,
                std::chrono::milliseconds timeout) {
  assert(!code.empty());
  const cs_client_options options{};
  const std::unique_ptr<cs_client, decltype(&cs_destroy)> core(cs_create(&options), &cs_destroy);
  cs_set_pairing_code(core.get(), code.c_str());
  const auto end = Clock::now() + timeout;
  std::optional<Answer> answer;
  bool sent = false;
  transport.connect("");
  while (!answer && transport.active() && Clock::now() < end) {
    if (transport.canWrite() && !sent) {
      sent = true;
      // The first message has the code. The next one, Hello, would join a scene.
      std::size_t bytes = 0;
      const std::uint8_t* const message = cs_next_outgoing(core.get(), &bytes);
      transport.write(std::as_bytes(std::span(message, bytes)));
    }
    transport.wait(end - Clock::now());
    if (const auto message = transport.receive()) answer = answerIn(core.get(), *message, address);
  }
  if (!answer && !transport.active()) return tl::unexpected(transport.notJoined());
  sayGoodbye(transport);
  if (answer) return *answer;
  return tl::unexpected(
      Failure{Failure::Kind::unreachable, "No clothstream-server answers at " + address.address +
                                              " in time: is it running there, and is the address right?"});
}

}  // namespace clothstream
