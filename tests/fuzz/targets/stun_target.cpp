// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/stun_target.h"

#include <chrono>
#include <string>

#include "proto/ice/checking_agent.h"
#include "proto/ice/lite_agent.h"
#include "tests/ice/sealed_message.h"

namespace clothstream::fuzz {
namespace {

using namespace std::chrono_literals;

const ice::Time kStart{1000s};
const ice::Address kPeer = ice::Address::ofIpv4({192, 0, 2, 1}, 1000);

// Fixed, so that a fuzzer can find the user names "serv:clie" and "clie:serv".
const ice::Credentials& serverCredentials() {
  static const ice::Credentials credentials{.ufrag = "serv", .password = "passwordofserverpasswo"};
  return credentials;
}
const ice::Credentials& clientCredentials() {
  static const ice::Credentials credentials{.ufrag = "clie", .password = "passwordofclientpasswo"};
  return credentials;
}

void checkAnswers(const std::vector<ice::Datagram>& out, std::span<const std::byte> datagram) {
  std::size_t bytes = 0;
  for (const ice::Datagram& sent : out) {
    require(sent.to == kPeer, "datagrams go where the request came from");
    require(sent.bytes.size() <= datagram.size(), "an answer is not longer than the request");
    require(ice::readStun(sent.bytes).has_value(), "an answer is a STUN message");
    bytes += sent.bytes.size();
  }
  require(bytes <= 2 * datagram.size(), "one answer and one check");
}

void handle(std::span<const std::byte> datagram) {
  const auto message = ice::readStun(datagram);
  if (message) {
    require(message->integrityAt < datagram.size(), "MESSAGE-INTEGRITY lies within the datagram");
    require(message->username.size() <= datagram.size(), "the user name lies within the datagram");
    require(message->unknown.size() <= ice::StunMessage::kMaxUnknown, "unknown attributes are bounded");
  }
  const auto knows = [&](const ice::Credentials& owner) {
    return message && ice::hasIntegrity(*message, datagram, owner.password);
  };
  ice::LiteAgent server(serverCredentials(), clientCredentials(), kStart);
  const auto out = server.handle(kPeer, datagram, kStart);
  require(out.empty() || knows(serverCredentials()), "only who knows the password gets an answer");
  checkAnswers(out, datagram);
  std::size_t bytes = 0;
  for (const ice::Datagram& sent : out) bytes += sent.bytes.size();
  for (const ice::Datagram& sent : server.advance(kStart + 1s)) bytes += sent.bytes.size();
  require(bytes <= 3 * datagram.size(), "at most three times the request");
  require(!server.selected(kStart), "no request selects an address");

  ice::CheckingAgent client(clientCredentials(), serverCredentials(), {&kPeer, 1}, kStart);
  static_cast<void>(client.advance(kStart));
  const auto answers = client.handle(kPeer, datagram, kStart);
  require(answers.empty() || knows(clientCredentials()), "only who knows the password gets an answer");
  checkAnswers(answers, datagram);
  require(!client.selected(kStart), "only the answer to a check selects an address");
}

void run(std::span<const std::byte> input) {
  if (input.empty() || input.size() > 2 * ice::kMaxStunBytes) return;
  const auto rest = input.subspan(1);
  constexpr ice::StunKind kKinds[] = {ice::StunKind::request, ice::StunKind::indication,
                                      ice::StunKind::success, ice::StunKind::error};
  const auto first = std::to_integer<unsigned>(input[0]);
  if (first % 2 == 0) return handle(rest);
  const std::string& password = first & 2 ? clientCredentials().password : serverCredentials().password;
  handle(ice::sealed(kKinds[first >> 2 & 3], rest, first & 16 ? "" : password));
}

}  // namespace

const Target kStunTarget{.name = "stun", .run = &run};

}  // namespace clothstream::fuzz
