// SPDX-License-Identifier: MIT
#include "proto/dtls/certificate.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::dtls {
namespace {

TEST(DtlsCertificateTest, IsSelfSignedWithOwnKey) {
  const Certificate one, two;
  EXPECT_EQ(X509_check_private_key(&one.x509(), &one.key()), 1);
  EXPECT_EQ(X509_verify(&one.x509(), &one.key()), 1);
  EXPECT_EQ(X509_verify(&one.x509(), &two.key()), 0);
  EXPECT_NE(one.fingerprint(), two.fingerprint());
  EXPECT_EQ(fingerprintOf(one.x509()), one.fingerprint());
}

TEST(DtlsCertificateTest, FingerprintHasTheFormOfSdp) {
  const Certificate certificate;
  EXPECT_THAT(certificate.fingerprint(),
              testing::MatchesRegex("sha-256 ([0-9A-F][0-9A-F]:)*[0-9A-F][0-9A-F]"));
  EXPECT_EQ(certificate.fingerprint().size(), 103U);
  EXPECT_EQ(readFingerprint(certificate.fingerprint()), certificate.fingerprint());
}

TEST(DtlsCertificateTest, ReadsSmallLettersAndRefusesOthers) {
  std::string small = "SHA-256 ab";
  for (int i = 0; i < 31; ++i) small += ":0f";
  const auto read = readFingerprint(small);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->substr(0, 14), "sha-256 AB:0F:");
  EXPECT_FALSE(readFingerprint(""));
  EXPECT_FALSE(readFingerprint("sha-256 "));
  EXPECT_FALSE(readFingerprint("sha-1 " + small.substr(8)));
  EXPECT_FALSE(readFingerprint(small.substr(8)));
  EXPECT_FALSE(readFingerprint(small.substr(0, small.size() - 1)));
  EXPECT_FALSE(readFingerprint(small + ":0f"));
  EXPECT_FALSE(readFingerprint(small + std::string(1'000'000, ' ')));
}

}  // namespace
}  // namespace clothstream::dtls
