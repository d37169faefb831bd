// SPDX-License-Identifier: MIT
#include "server/events/webhook.h"

#include <array>
#include <cstring>
#include <stdexcept>
#include <vector>

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include "server/files/regular_file.h"

namespace clothstream::events {
namespace {

constexpr std::string_view kPrefix = "whsec_", kSpace = " \t\r\n";
constexpr std::size_t kMaxFileBytes = 4096;
constexpr std::size_t kIdBytes = 16;

std::string toBase64(std::string_view bytes) {
  // Four characters for each three bytes, and a zero, which OpenSSL writes.
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int size =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                      reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

// Returns an empty string if the text is not base64 with padding.
std::string fromBase64(std::string_view text) {
  std::string bytes(3 * (text.size() / 4) + 3, '\0');
  const int size =
      EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()),
                      reinterpret_cast<const unsigned char*>(text.data()), static_cast<int>(text.size()));
  const std::size_t padding = text.ends_with("==") ? 2 : text.ends_with("=") ? 1 : 0;
  if (size < 0 || static_cast<std::size_t>(size) < padding) return {};
  bytes.resize(static_cast<std::size_t>(size) - padding);
  // OpenSSL accepts more than base64, such as padding in the middle.
  return toBase64(bytes) == text ? bytes : std::string();
}

}  // namespace

tl::expected<std::string, std::string> parseSecret(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kSpace);
  text = first == std::string_view::npos ? std::string_view()
                                         : text.substr(first, text.find_last_not_of(kSpace) + 1 - first);
  const std::string expected =
      fmt::format("use {} and the base64 of {} to {} random bytes", kPrefix, kMinKeyBytes, kMaxKeyBytes);
  if (text.empty()) return tl::unexpected("is empty; " + expected);
  if (!text.starts_with(kPrefix))
    return tl::unexpected(fmt::format("does not begin with {}; {}", kPrefix, expected));
  std::string key = fromBase64(text.substr(kPrefix.size()));
  if (key.empty()) return tl::unexpected(fmt::format("has no base64 after {}; {}", kPrefix, expected));
  if (key.size() < kMinKeyBytes || key.size() > kMaxKeyBytes)
    return tl::unexpected(fmt::format("has a key of {} bytes; {}", key.size(), expected));
  return key;
}

std::string readSecret(const std::filesystem::path& file) {
  const auto fail = [&](const std::string& why) {
    throw std::runtime_error(fmt::format("--events-secret-file: {} {}", file.string(), why));
  };
  auto text = files::readRegularFile(file, kMaxFileBytes);
  if (!text) fail(text.error().text);
  tl::expected<std::string, std::string> key = parseSecret(*text);
  OPENSSL_cleanse(text->data(), text->size());
  if (!key) fail(key.error());
  struct stat status {};
  if (::stat(file.c_str(), &status) == 0 && (status.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    spdlog::warn("other users can read the secret in {}: run chmod 600", file.string());
  return *key;
}

std::string signatureOf(const std::string& key, std::string_view id, std::int64_t timestamp,
                        std::string_view body) {
  const std::string content = fmt::format("{}.{}.{}", id, timestamp, body);
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  if (HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
           reinterpret_cast<const unsigned char*>(content.data()), content.size(), digest.data(),
           &size) == nullptr)
    throw std::runtime_error("a message cannot be signed");
  return "v1," + toBase64({reinterpret_cast<const char*>(digest.data()), size});
}

std::string makeId() {
  std::array<unsigned char, kIdBytes> random{};
  if (RAND_bytes(random.data(), static_cast<int>(random.size())) != 1)
    throw std::runtime_error("the system has no random numbers");
  std::string id = "msg_";
  for (const unsigned char byte : random) id += fmt::format("{:02x}", byte);
  return id;
}

}  // namespace clothstream::events
