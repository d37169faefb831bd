// SPDX-License-Identifier: MIT
#include "proto/ice/connectivity_check.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <openssl/rand.h>

namespace clothstream::ice {
namespace {

// Characters of fragments and passwords (ice-char of RFC 8839, section 5.4).
constexpr std::string_view kCharacters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

// Priority of a peer-reflexive candidate with the only component (RFC 8445, sections 5.1.2 and 7.1.1).
constexpr std::uint32_t kHostPriority = 110U << 24 | 65535U << 8 | 255U;

void fillRandom(std::span<std::byte> bytes) {
  if (RAND_bytes(reinterpret_cast<unsigned char*>(bytes.data()), static_cast<int>(bytes.size())) != 1)
    throw std::runtime_error("OpenSSL has no random numbers");
}

std::string randomText(std::size_t size) {
  std::string text(size, '\0');
  fillRandom(std::as_writable_bytes(std::span(text)));
  for (char& letter : text) letter = kCharacters[static_cast<unsigned char>(letter) % kCharacters.size()];
  return text;
}

std::uint64_t randomNumber() {
  std::uint64_t number = 0;
  fillRandom(std::as_writable_bytes(std::span(&number, 1)));
  return number;
}

bool hasOnlyIceCharacters(std::string_view text, std::size_t least, std::size_t most) {
  return text.size() >= least && text.size() <= most &&
         text.find_first_not_of(kCharacters) == std::string_view::npos;
}

}  // namespace

bool isValid(const Credentials& credentials) {
  return hasOnlyIceCharacters(credentials.ufrag, 4, 64) &&
         hasOnlyIceCharacters(credentials.password, 22, 256);
}

Credentials randomCredentials() {
  return {.ufrag = randomText(8), .password = randomText(24)};
}

TransactionId newTransaction() {
  TransactionId transaction;
  fillRandom(transaction);
  return transaction;
}

Pairing::Pairing(Credentials local, Credentials remote, Role role)
    : local_(std::move(local)),
      remote_(std::move(remote)),
      role_(role),
      sentUsername_(remote_.ufrag + ':' + local_.ufrag),
      receivedUsername_(local_.ufrag + ':' + remote_.ufrag),
      tieBreaker_(randomNumber()) {
  assert(isValid(local_) && isValid(remote_));
}

std::vector<std::byte> Pairing::check(const TransactionId& transaction, bool nominate) const {
  assert(!nominate || role_ == Role::controlling);
  return writeStun({.kind = StunKind::request,
                    .transaction = transaction,
                    .username = sentUsername_,
                    .priority = kHostPriority,
                    .role = role_,
                    .tieBreaker = tieBreaker_,
                    .useCandidate = nominate},
                   remote_.password);
}

std::optional<Pairing::Answer> Pairing::answer(const StunMessage& request,
                                               std::span<const std::byte> datagram,
                                               const Address& from) const {
  if (request.kind != StunKind::request || request.username != receivedUsername_ ||
      !hasIntegrity(request, datagram, local_.password))
    return std::nullopt;
  StunMessage response{.kind = StunKind::error, .transaction = request.transaction};
  Answer answer;
  if (!request.unknown.empty()) {
    response.error = kUnknownAttribute;
    response.unknown = request.unknown;
  } else if (!request.priority || !request.role) {
    response.error = kBadRequest;
  } else if (*request.role == role_) {
    response.error = kRoleConflict;  // a lite agent is always controlled, and only the other one controls it
  } else {
    response.kind = StunKind::success;
    response.mapped = from;
    answer.accepted = true;
    answer.nominates = request.useCandidate && role_ == Role::controlled;
  }
  answer.bytes = writeStun(response, local_.password);
  assert(answer.bytes.size() <= datagram.size());
  return answer;
}

bool Pairing::isAuthenticResponse(const StunMessage& response, std::span<const std::byte> datagram) const {
  return response.kind == StunKind::success && hasIntegrity(response, datagram, remote_.password);
}

}  // namespace clothstream::ice
