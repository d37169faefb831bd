// SPDX-License-Identifier: MIT
#include "server/tls/certificate.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "proto/tls/fingerprint.h"
#include "server/tls/qr_code.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::tls {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class CertificateTest : public ::testing::Test {
 protected:
  fs::path in(const char* name) const { return directory_.path() / name; }
  fs::path file(const char* name, const std::string& content) const {
    std::ofstream(in(name)) << content;
    return in(name);
  }

 private:
  e2e::TemporaryDirectory directory_;
};

std::string errorOf(const fs::path& chain, const fs::path& key) {
  try {
    readCertificate(chain, key);
    return "none";
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST_F(CertificateTest, SelfSignedKeepsItsKeyAndFollowsItsNames) {
  const fs::path directory = in("new") / "tls";
  const Certificate first = selfSigned(directory, {"localhost", "192.0.2.1"});
  EXPECT_EQ(fs::status(directory / "self.key").permissions(), fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(fs::status(directory).permissions(), fs::perms::owner_all);
  EXPECT_GT(expiryOf(first), std::chrono::system_clock::now() + std::chrono::hours(390 * 24));

  EXPECT_EQ(selfSigned(directory, {"localhost"}).chain, first.chain) << "it has the name already";
  const Certificate second = selfSigned(directory, {"localhost", "192.0.2.2", "2001:db8::1"});
  EXPECT_NE(second.chain, first.chain);
  EXPECT_EQ(second.key, first.key);
  EXPECT_EQ(fingerprintOf(second.chain), fingerprintOf(first.chain));
  EXPECT_EQ(selfSigned(directory, {"192.0.2.2", "2001:db8::1"}).chain, second.chain);
  EXPECT_NE(fingerprintOf(selfSigned(in("other"), {"localhost"}).chain), fingerprintOf(first.chain));
}

TEST_F(CertificateTest, SelfSignedNamesFaults) {
  file("occupied", "");
  EXPECT_THROW(selfSigned(in("occupied"), {"localhost"}), std::runtime_error);
  const fs::path directory = in("spoiled");
  selfSigned(directory, {"localhost"});
  std::ofstream(directory / "self.key") << "no key";
  try {
    selfSigned(directory, {"localhost"});
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("self.key"), HasSubstr("delete it")));
  }
}

TEST_F(CertificateTest, SelfSignedWritesOnlyIntoItsFolder) {
  const fs::path others = file("others", "x");
  fs::create_directory(in("elsewhere"));
  fs::create_directory_symlink(in("elsewhere"), in("tls"));
  EXPECT_THROW(selfSigned(in("tls"), {"localhost"}), std::runtime_error);
  EXPECT_TRUE(fs::is_empty(in("elsewhere")));
  fs::create_symlink(others, in("elsewhere") / "self.key.new");
  EXPECT_THROW(selfSigned(in("elsewhere"), {"localhost"}), std::runtime_error);
  EXPECT_EQ(fs::file_size(others), 1u);
}

TEST_F(CertificateTest, ReadsFilesAndNamesTheirFaults) {
  const Certificate one = selfSigned(in("one"), {"localhost"}), two = selfSigned(in("two"), {"localhost"});
  const fs::path chain = file("chain.pem", one.chain), key = file("key.pem", one.key);
  EXPECT_EQ(readCertificate(chain, key).chain, one.chain);
  EXPECT_THAT(errorOf(in("missing.pem"), key), AllOf(HasSubstr("missing.pem"), HasSubstr("No such file")));
  EXPECT_THAT(errorOf(file("empty.pem", ""), key),
              AllOf(HasSubstr("empty.pem"), HasSubstr("no certificate")));
  EXPECT_THAT(errorOf(key, key), HasSubstr("no certificate"));
  EXPECT_THAT(errorOf(chain, chain), HasSubstr("no private key"));
  EXPECT_THAT(errorOf(chain, file("other.pem", two.key)),
              AllOf(HasSubstr("other.pem"), HasSubstr("not the key")));
  EXPECT_THAT(errorOf(file("huge.pem", std::string(2 << 20, 'x')), key), HasSubstr("too large"));
  EXPECT_THAT(errorOf(in("one"), key), HasSubstr("not a regular file")) << "a directory";
  ASSERT_EQ(::mkfifo(in("fifo.pem").c_str(), S_IRUSR | S_IWUSR), 0);
  EXPECT_THAT(errorOf(in("fifo.pem"), key), HasSubstr("not a regular file"));
  EXPECT_THAT(errorOf(chain, in("fifo.pem")), HasSubstr("not a regular file"));
}

TEST(FingerprintTest, AcceptsTheFormsThatPeopleWrite) {
  const std::string normal =
      "00:11:22:33:44:55:66:77:88:99:AA:BB:CC:DD:EE:FF:00:11:22:33:44:55:66:77:88:99:AA:BB:CC:DD:EE:FF";
  EXPECT_EQ(normalFingerprint(normal), normal);
  EXPECT_EQ(normalFingerprint("00112233445566778899aabbccddeeff 00112233445566778899aabbccddeeff"), normal);
  for (const std::string& wrong : {std::string(), normal.substr(3), normal + ":00", std::string(64, 'g')})
    EXPECT_EQ(normalFingerprint(wrong), std::nullopt) << wrong;
  EXPECT_EQ(fingerprintOf("no certificate"), std::nullopt);
}

TEST(NamesOfThisMachine, HaveLocalhostAndItsAddress) {
  EXPECT_THAT(namesOfThisMachine(), AllOf(testing::Contains("localhost"), testing::Contains("127.0.0.1")));
}

// The image draws one square of one by one for each dark module. The smallest code has 21 by 21 modules, and
// its three corners have 33 dark ones each.
TEST(QrCodeTest, DrawsSquaresInsideTheQuietZone) {
  const std::string image = qrImage("https://192.0.2.1:8443/");
  EXPECT_THAT(image, testing::StartsWith("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 33 33\""));
  std::size_t squares = 0;
  for (std::size_t at = image.find("h1v1h-1z"); at != std::string::npos; at = image.find("h1v1h-1z", at + 1))
    ++squares;
  EXPECT_GT(squares, 3U * 33);
  EXPECT_LT(squares, 25U * 25);
  EXPECT_THAT(image, HasSubstr("M4 4h1"));
  EXPECT_EQ(qrCode(std::string(10'000, 'x')), "");
}

}  // namespace
}  // namespace clothstream::tls
