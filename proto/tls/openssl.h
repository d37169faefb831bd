// SPDX-License-Identifier: MIT
// Ownership and errors of OpenSSL's objects.
#pragma once

#include <array>
#include <memory>
#include <stdexcept>
#include <string>

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

namespace clothstream::tls {

// Deleter that calls a function of OpenSSL.
template <auto Free>
struct Freed {
  template <typename T>
  void operator()(T* pointer) const {
    Free(pointer);
  }
};
using Bio = std::unique_ptr<BIO, Freed<BIO_free>>;
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using X509Certificate = std::unique_ptr<X509, Freed<X509_free>>;

// Text of the first error in this thread's queue, which is then empty.
inline std::string opensslError() {
  std::array<char, 256> text{};
  ERR_error_string_n(ERR_get_error(), text.data(), text.size());
  ERR_clear_error();
  return text.data();
}

// Returns the result of an OpenSSL call. Throws std::runtime_error with `what` and OpenSSL's text if it is 0
// or null.
template <typename T>
T check(T result, const char* what) {
  if (!result) throw std::runtime_error(std::string(what) + ": " + opensslError());
  return result;
}

}  // namespace clothstream::tls
