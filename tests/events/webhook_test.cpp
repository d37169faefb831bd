// SPDX-License-Identifier: MIT
// Secrets and signatures of webhooks.
#include "server/events/webhook.h"

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

namespace clothstream::events {
namespace {

using testing::HasSubstr;

// The bytes 0 to 31.
constexpr const char* kSecret = "whsec_AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8=";

TEST(Webhook, SecretHasAKey) {
  const auto key = parseSecret(kSecret);
  ASSERT_TRUE(key) << key.error();
  ASSERT_EQ(key->size(), 32u);
  for (std::size_t i = 0; i < key->size(); ++i) EXPECT_EQ((*key)[i], static_cast<char>(i));
  EXPECT_EQ(*parseSecret(std::string(" ") + kSecret + "\r\n"), *key);
  EXPECT_EQ(parseSecret("whsec_" + std::string(32, 'A'))->size(), kMinKeyBytes);
  EXPECT_EQ(parseSecret("whsec_" + std::string(84, 'A') + "AA==")->size(), kMaxKeyBytes);
}

TEST(Webhook, ErrorsOfSecretsSayWhatIsWrong) {
  const auto refuses = [](const std::string& text, const char* why) {
    const auto key = parseSecret(text);
    ASSERT_FALSE(key) << text;
    EXPECT_THAT(key.error(), HasSubstr(why));
    EXPECT_THAT(key.error(), HasSubstr("use whsec_ and the base64 of 24 to 64 random bytes"));
  };
  refuses("", "is empty");
  refuses(" \n", "is empty");
  refuses("AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8=", "does not begin with whsec_");
  refuses("whsec_", "has no base64");
  refuses("whsec_AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8", "has no base64");
  refuses("whsec_AAECAwQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh9=", "has no base64");
  refuses("whsec_AAEC_wQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8=", "has no base64");
  refuses("whsec_AAEC=AQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8=", "has no base64");
  refuses("whsec_AAEC AQFBgcICQoLDA0ODxAREhMUFRYXGBkaGxwdHh8=", "has no base64");
  refuses("whsec_" + std::string(28, 'A') + "AAA=", "has a key of 23 bytes");
  refuses("whsec_" + std::string(84, 'A') + "AAA=", "has a key of 65 bytes");
}

// Computed by hmac and base64 of Python.
TEST(Webhook, SignatureCoversIdTimeAndBody) {
  const std::string key = *parseSecret(kSecret);
  EXPECT_EQ(signatureOf(key, "msg_1", 1'700'000'000, R"({"type":"test"})"),
            "v1,Sd1eZeq9dRAkhuhKIQFBq4Ht8dNNGGGC2csjXSNSSYk=");
  EXPECT_NE(signatureOf(key, "msg_1", 1'700'000'001, R"({"type":"test"})"),
            signatureOf(key, "msg_1", 1'700'000'000, R"({"type":"test"})"));
}

TEST(Webhook, IdsDiffer) {
  const std::string id = makeId();
  EXPECT_EQ(id.size(), std::string("msg_").size() + 32);
  EXPECT_TRUE(id.starts_with("msg_"));
  EXPECT_NE(id, makeId());
}

TEST(Webhook, ErrorsOfFilesNameTheFile) {
  const auto file = std::filesystem::temp_directory_path() /
                    ("clothstream-events-" + std::to_string(::getpid()) + ".secret");
  const auto problem = [&] {
    try {
      readSecret(file);
    } catch (const std::runtime_error& failure) {
      return std::string(failure.what());
    }
    return std::string();
  };
  EXPECT_EQ(problem(),
            "--events-secret-file: " + file.string() + " cannot be read: No such file or directory");
  std::ofstream(file) << "whsec_short\n";
  EXPECT_THAT(problem(), HasSubstr(file.string() + " has no base64 after whsec_"));
  std::ofstream(file) << std::string(5000, 'x');
  EXPECT_THAT(problem(), HasSubstr("is too large: at most 4096 bytes are allowed"));
  std::ofstream(file) << kSecret << "\n";
  EXPECT_EQ(problem(), "");
  EXPECT_EQ(readSecret(file).size(), 32u);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace clothstream::events
