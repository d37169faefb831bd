// SPDX-License-Identifier: MIT
// Keys that sign and check tokens.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>

namespace clothstream::identity {

// Minimum size of a secret of HS256, in bytes.
inline constexpr std::size_t kMinSecretBytes = 32;

enum class Algorithm : std::uint8_t { es256, hs256 };
const char* nameOf(Algorithm algorithm);

struct TokenKey {
  std::string id;  // `kid` of its tokens: the name of the file without its extension
  Algorithm algorithm = Algorithm::es256;
  std::string checking;  // ES256: public key as PEM; HS256: secret
  std::string signing;   // ES256: private key as PEM, or empty; HS256: secret
  std::string digest{};  // SHA-256 of `checking`: differs from that of every other key
  bool exposed = false;  // other users of the machine can read `signing`
};

// By id.
using TokenKeys = std::map<std::string, TokenKey>;

// Reads ID.pem (public or private key of the curve P-256, for ES256) or ID.secret (at least kMinSecretBytes,
// for HS256; spaces and line ends at its end are ignored). An id has 1 to 64 characters of A-Z, a-z, 0-9,
// '.', '_' and '-'. Throws std::runtime_error that names the file and what is wrong.
TokenKey readTokenKey(const std::filesystem::path& file);

// Reads all *.pem and *.secret files of the directory. Throws as above, or if there are none or two have the
// same id.
TokenKeys readTokenKeys(const std::filesystem::path& directory);

// Writes a new key with mode 0600: a private key for a name that ends in .pem, a secret for .secret. The file
// appears only when it is complete, even if the process or the machine stops before. Throws
// std::runtime_error, also if the file exists.
void makeTokenKey(const std::filesystem::path& file);

// Random bytes of the operating system, in hexadecimal digits: two for each byte. Throws std::runtime_error.
std::string randomHex(std::size_t bytes);

}  // namespace clothstream::identity
