// SPDX-License-Identifier: MIT
#include "proto/tls/self_signed.h"

#include <array>
#include <memory>
#include <string_view>

#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

namespace clothstream::tls {
namespace {

void addExtension(X509& certificate, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, &certificate, &certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>> extension(
      check(X509V3_EXT_nconf_nid(nullptr, &context, kind, value.c_str()), "extension of a certificate"));
  check(X509_add_ext(&certificate, extension.get(), -1), "extension of a certificate");
}

}  // namespace

Key makeKey() {
  return Key(check(EVP_EC_gen("P-256"), "key"));
}

X509Certificate makeCertificate(EVP_PKEY& key, std::chrono::hours validity, const std::string& names) {
  X509Certificate certificate(check(X509_new(), "memory"));
  X509& x509 = *certificate;
  check(X509_set_version(&x509, X509_VERSION_3), "certificate");
  // 20 bytes at most, and positive (RFC 5280, 4.1.2.2).
  std::array<unsigned char, 16> serial{};
  check(RAND_bytes(serial.data(), serial.size()) == 1, "random numbers");
  serial[0] &= 0x7F;
  const std::unique_ptr<BIGNUM, Freed<BN_free>> number(
      check(BN_bin2bn(serial.data(), serial.size(), nullptr), "memory"));
  check(BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(&x509)), "certificate");
  constexpr long kDay = 24 * 3600;
  check(X509_gmtime_adj(X509_getm_notBefore(&x509), -kDay), "certificate");
  check(X509_gmtime_adj(X509_getm_notAfter(&x509), std::chrono::seconds(validity).count() - kDay),
        "certificate");
  check(X509_set_pubkey(&x509, &key), "certificate");
  X509_NAME* const subject = X509_get_subject_name(&x509);
  constexpr std::string_view kSubject = "ClothStream";
  check(X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC,
                                   reinterpret_cast<const unsigned char*>(kSubject.data()),
                                   static_cast<int>(kSubject.size()), -1, 0),
        "certificate");
  check(X509_set_issuer_name(&x509, subject), "certificate");
  if (!names.empty()) {
    addExtension(x509, NID_subject_alt_name, names);
    addExtension(x509, NID_ext_key_usage, "serverAuth");
  }
  addExtension(x509, NID_basic_constraints, "critical,CA:FALSE");
  addExtension(x509, NID_key_usage, "critical,digitalSignature");
  check(X509_sign(&x509, &key, EVP_sha256()), "signature of a certificate");
  return certificate;
}

}  // namespace clothstream::tls
