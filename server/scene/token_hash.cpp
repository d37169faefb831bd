// SPDX-License-Identifier: MIT
#include "server/scene/token_hash.h"

#include <openssl/sha.h>

namespace clothstream::scene {

std::string hashOfToken(std::string_view token) {
  static_assert(kTokenHashBytes == SHA256_DIGEST_LENGTH);
  std::string hash(kTokenHashBytes, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(),
         reinterpret_cast<unsigned char*>(hash.data()));
  return hash;
}

}  // namespace clothstream::scene
