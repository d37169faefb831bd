// SPDX-License-Identifier: MIT
#include "server/identity/pairing_codes.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::identity {
namespace {

constexpr std::uint32_t kCodes = 1'000'000;
constexpr std::size_t kDigits = 6;

// Uniform: numbers of the last, incomplete part of the range are drawn again.
std::string randomCode() {
  constexpr std::uint32_t kEnd = UINT32_MAX - UINT32_MAX % kCodes;
  for (;;) {
    std::array<unsigned char, sizeof(std::uint32_t)> bytes{};
    if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1)
      throw std::runtime_error("the system has no random numbers");
    std::uint32_t number = 0;
    std::memcpy(&number, bytes.data(), bytes.size());
    if (number < kEnd) return fmt::format("{:06}", number % kCodes);
  }
}

tl::unexpected<messages::FieldError> wrong(std::string text) {
  return tl::unexpected(messages::FieldError{v1::ERROR_CODE_WRONG_PAIRING_CODE, std::move(text)});
}

}  // namespace

PairingCode PairingCodes::make(scene::Role role, Clock::time_point now) {
  expire(now);
  std::erase_if(codes_, [&](const PairingCode& known) { return known.role == role; });
  PairingCode made{.code = randomCode(), .role = role, .ends = now + kValid};
  // Two roles must not have the same code.
  while (std::ranges::any_of(codes_, [&](const PairingCode& known) { return known.code == made.code; }))
    made.code = randomCode();
  codes_.push_back(made);
  wrongInAll_ = 0;
  return made;
}

void PairingCodes::expire(Clock::time_point now) {
  std::erase_if(codes_, [&](const PairingCode& known) { return now >= known.ends; });
  std::erase_if(wrong_, [&](const Wrong& known) {
    return now - known.newest >= (known.count >= kWrongPerAddress ? Clock::duration(kLockout) : kValid);
  });
}

PairingCodes::Wrong& PairingCodes::wrongOf(const std::string& address) {
  const auto known = std::ranges::find(wrong_, address, &Wrong::address);
  if (known != wrong_.end()) return *known;
  if (wrong_.size() >= kMaxAddresses) wrong_.erase(std::ranges::min_element(wrong_, {}, &Wrong::newest));
  return wrong_.emplace_back(Wrong{.address = address});
}

messages::Result<scene::Role> PairingCodes::take(const std::string& code, const std::string& address,
                                                 Clock::time_point now) {
  expire(now);
  const auto attempts = std::ranges::find(wrong_, address, &Wrong::address);
  if (attempts != wrong_.end() && attempts->count >= kWrongPerAddress)
    return wrong(fmt::format("{} wrong pairing codes came from your address: try again in a minute",
                             kWrongPerAddress));
  if (codes_.empty())
    return wrong("there is no pairing code now: the operator makes one with SIGUSR2, an owner on the page");
  scene::Role role = scene::Role::none;
  for (const PairingCode& known : codes_)
    if (code.size() == kDigits && CRYPTO_memcmp(code.data(), known.code.data(), kDigits) == 0)
      role = known.role;
  if (role != scene::Role::none) {
    std::erase_if(wrong_, [&](const Wrong& known) { return known.address == address; });
    return role;
  }
  Wrong& mine = wrongOf(address);
  ++mine.count;
  mine.newest = now;
  if (++wrongInAll_ >= kWrongInAll) {
    codes_.clear();
    return wrong(
        "the pairing code is wrong; all codes have ended because too many wrong ones were sent: ask for a "
        "new one");
  }
  if (mine.count >= kWrongPerAddress)
    return wrong(
        fmt::format("the pairing code is wrong; your address has sent {} wrong ones: try again in a minute",
                    kWrongPerAddress));
  return wrong("the pairing code is wrong; codes have six digits and are valid for five minutes");
}

}  // namespace clothstream::identity
