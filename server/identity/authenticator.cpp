// SPDX-License-Identifier: MIT
#include "server/identity/authenticator.h"

#include <stdexcept>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "clothstream/v1/session.pb.h"
#include "server/files/state_directory.h"
#include "server/identity/token.h"

namespace clothstream::identity {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kSubjectBytes = 8;

// Reads the key for pairing from the state directory, and makes it before its first use.
TokenKey pairingKey(const fs::path& stateDirectory) {
  if (stateDirectory.empty())
    throw std::runtime_error("--pairing needs a directory for its key: use --state-dir DIR");
  const fs::path directory = stateDirectory / "identity";
  if (const auto made = files::makeStateDirectory(directory); !made)
    throw std::runtime_error(fmt::format("{}: {}", directory.string(), made.error()));
  std::error_code ignored;
  fs::permissions(directory, fs::perms::owner_all, ignored);
  const fs::path file = directory / fmt::format("{}.secret", kPairingKeyId);
  if (!fs::exists(file)) makeTokenKey(file);
  return readTokenKey(file);
}

}  // namespace

Authenticator::Authenticator(AuthenticatorOptions options) : options_(std::move(options)) {
  keys_ = readKeys({});
}

std::shared_ptr<const TokenKeys> Authenticator::readKeys(const TokenKeys& known) const {
  TokenKeys keys;
  if (!options_.keyDirectory.empty()) keys = readTokenKeys(options_.keyDirectory);
  if (options_.pairing && !keys.emplace(kPairingKeyId, pairingKey(options_.stateDirectory)).second)
    throw std::runtime_error(
        fmt::format("{}: has a key named '{}', which is the name of the key for pairing; rename it",
                    options_.keyDirectory.string(), kPairingKeyId));
  for (const auto& [id, key] : keys)
    if (key.exposed && !known.contains(id))
      spdlog::warn(
          "other users of this machine can read the key '{}' and make tokens with it: set its mode to 600",
          id);
  return std::make_shared<const TokenKeys>(std::move(keys));
}

Authenticator::Present Authenticator::present() const {
  const std::lock_guard lock(mutex_);
  return {.keys = keys_, .now = clock_()};
}

messages::Result<Identity> Authenticator::anonymous(bool isLoopback) const {
  if (required())
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_UNAUTHENTICATED, options_.pairing ? "this server requires a token or a pairing code"
                                                         : "this server requires a token"});
  Identity identity;
  identity.role = isLoopback ? scene::Role::owner : options_.anonymousRole;
  return identity;
}

messages::Result<Identity> Authenticator::verify(const std::string& token, bool isLoopback) const {
  if (!required()) return anonymous(isLoopback);
  const Present with = present();
  return check(token, *with.keys, options_.audience, with.now);
}

messages::Result<Authenticator::Paired> Authenticator::pair(const std::string& code,
                                                            const std::string& address,
                                                            Clock::time_point now) {
  if (!options_.pairing)
    return tl::unexpected(messages::FieldError{v1::ERROR_CODE_WRONG_PAIRING_CODE,
                                               "this server does not pair: it needs --pairing"});
  const messages::Result<scene::Role> role = [&] {
    const std::lock_guard lock(codesMutex_);
    return codes_.take(code, address, now);
  }();
  if (!role) return tl::unexpected(role.error());
  const Present with = present();
  Claims claims;
  claims.role = *role;
  claims.subject = "paired-" + randomHex(kSubjectBytes);
  claims.audience = options_.audience;
  claims.expires = with.now + kPairingValid;
  Paired paired;
  paired.token = sign(with.keys->at(kPairingKeyId), claims);
  messages::Result<Identity> identity = check(paired.token, *with.keys, options_.audience, with.now);
  if (!identity) return tl::unexpected(std::move(identity).error());
  paired.identity = std::move(*identity);
  return paired;
}

messages::Result<PairingCode> Authenticator::makeCode(scene::Role role, Clock::time_point now) {
  if (!options_.pairing)
    return tl::unexpected(
        messages::FieldError{v1::ERROR_CODE_INVALID_ARGUMENT,
                             "createPairingCode: this server does not pair; start it with --pairing"});
  const std::lock_guard lock(codesMutex_);
  return codes_.make(role, now);
}

const char* Authenticator::whyEnded(const Identity& identity, std::chrono::seconds grace) const {
  if (!identity.verified) return nullptr;
  const Present with = present();
  if (identity.expires && with.now - grace >= *identity.expires)
    return "your token has expired: connect again with a new one";
  const auto key = with.keys->find(identity.keyId);
  if (key == with.keys->end() || key->second.digest != identity.keyDigest)
    return "the key of your token is no longer in use: connect again with a token of another key";
  return nullptr;
}

void Authenticator::reload() {
  std::shared_ptr<const TokenKeys> keys = readKeys(*present().keys);
  const std::lock_guard lock(mutex_);
  keys_ = std::move(keys);
}

void Authenticator::setClock(std::function<WallClock::time_point()> clock) {
  const std::lock_guard lock(mutex_);
  clock_ = std::move(clock);
}

}  // namespace clothstream::identity
