// SPDX-License-Identifier: MIT
// Decides who a peer is: by its token, by a pairing code, or by where it comes from.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "server/identity/identity.h"
#include "server/identity/pairing_codes.h"
#include "server/identity/token_key.h"
#include "server/messages/field_error.h"

namespace clothstream::identity {

struct AuthenticatorOptions {
  std::filesystem::path keyDirectory;  // keys of tokens; empty: none
  std::string audience = "clothstream";
  bool pairing = false;
  std::filesystem::path stateDirectory;  // of the key for pairing; it is made if it does not exist
  // Role of peers without a token that come from other machines; used only with neither keys nor pairing.
  // Programs of this machine then have the role owner.
  scene::Role anonymousRole = scene::Role::participant;
};

// Thread-safe.
class Authenticator {
 public:
  // Streams continue for this time after their token has expired.
  static constexpr std::chrono::seconds kExpiryGrace{60};
  // Tokens of pairing are valid for this time.
  static constexpr std::chrono::hours kPairingValid{365 * 24};

  // Reads the keys. Throws std::runtime_error that names the file and what is wrong.
  explicit Authenticator(AuthenticatorOptions options);

  // Returns whether every peer needs a token.
  bool required() const { return !options_.keyDirectory.empty() || options_.pairing; }
  bool pairs() const { return options_.pairing; }
  // Returns whether tokens may name tenants. Those of pairing do not.
  bool hasTenants() const { return !options_.keyDirectory.empty(); }

  // Identity of a peer that has sent neither token nor code; UNAUTHENTICATED if one is required.
  [[nodiscard]] messages::Result<Identity> anonymous(bool isLoopback) const;
  // Checks a token as check() in token.h does. Without keys and pairing, tokens are ignored.
  [[nodiscard]] messages::Result<Identity> verify(const std::string& token, bool isLoopback) const;

  struct Paired {
    Identity identity;
    std::string token;
  };
  // Issues a token with a random subject to a peer that knows a code. Errors are those of
  // PairingCodes::take(), and WRONG_PAIRING_CODE without pairing.
  [[nodiscard]] messages::Result<Paired> pair(const std::string& code, const std::string& address,
                                              Clock::time_point now);
  // INVALID_ARGUMENT without pairing.
  [[nodiscard]] messages::Result<PairingCode> makeCode(scene::Role role, Clock::time_point now);

  // Returns null while this identity is valid. Otherwise returns the reason as a text for the peer: `grace`
  // has passed since its token expired, or the key of the token is no longer in use. Does not wait for other
  // threads.
  const char* whyEnded(const Identity& identity, std::chrono::seconds grace) const;

  // Reads the keys of tokens again. If it throws, the former keys stay in use.
  void reload();

  // Replaces the clock by which tokens expire, in tests.
  void setClock(std::function<WallClock::time_point()> clock);

 private:
  using Time = std::function<WallClock::time_point()>;
  // Keys and time at one moment.
  struct Present {
    std::shared_ptr<const TokenKeys> keys;
    WallClock::time_point now;
  };

  Present present() const;
  // Warns of keys with a secret that other users can read, unless `known` has them.
  std::shared_ptr<const TokenKeys> readKeys(const TokenKeys& known) const;

  const AuthenticatorOptions options_;
  std::mutex codesMutex_;  // protects codes_
  PairingCodes codes_;
  mutable std::mutex mutex_;               // protects all below; held only to copy or replace them
  std::shared_ptr<const TokenKeys> keys_;  // including the key for pairing; never null
  Time clock_ = &WallClock::now;
};

// Name of the key with which the server signs tokens of pairing.
inline constexpr const char* kPairingKeyId = "pairing";

}  // namespace clothstream::identity
