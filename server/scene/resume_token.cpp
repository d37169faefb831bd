// SPDX-License-Identifier: MIT
#include "server/scene/resume_token.h"

#include <cstdint>
#include <random>

#include <openssl/sha.h>

namespace clothstream::scene {

std::string makeToken() {
  std::random_device random;
  std::string token;
  while (token.size() < kTokenBytes) {
    const std::uint32_t word = random();
    for (int shift = 0; shift < 32; shift += 8) token += static_cast<char>(word >> shift);
  }
  return token;
}

std::string hashOfToken(std::string_view token) {
  static_assert(kTokenHashBytes == SHA256_DIGEST_LENGTH);
  std::string hash(kTokenHashBytes, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(),
         reinterpret_cast<unsigned char*>(hash.data()));
  return hash;
}

bool isSameHash(std::string_view one, std::string_view other) {
  if (one.size() != other.size()) return false;
  unsigned different = 0;
  for (std::size_t i = 0; i < one.size(); ++i)
    different |= static_cast<unsigned char>(one[i]) ^ static_cast<unsigned char>(other[i]);
  return different == 0;
}

}  // namespace clothstream::scene
