// SPDX-License-Identifier: MIT
#include "server/identity/token_key.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/bio.h>
#include <openssl/crypto.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/tls/openssl.h"
#include "server/files/regular_file.h"
#include "server/scene/resume_token.h"

namespace clothstream::identity {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFileBytes = 64 * 1024;
constexpr std::size_t kMaxIdBytes = 64;
constexpr std::size_t kNewSecretBytes = 32;
constexpr std::size_t kDraftBytes = 8;

using tls::Bio;
using tls::Key;

[[noreturn]] void fail(const fs::path& file, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}", file.string(), what));
}

std::string readFile(const fs::path& file) {
  auto text = files::readRegularFile(file, kMaxFileBytes);
  if (!text) fail(file, text.error().text);
  return std::move(*text);
}

// Writes a new file with mode 0600 to the disk. Returns 0, or the errno of the first call that failed.
int writeFile(const fs::path& file, const std::string& content) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (descriptor < 0) return errno;
  int failure = 0;
  for (std::size_t done = 0; failure == 0 && done < content.size();) {
    const ssize_t count = ::write(descriptor, content.data() + done, content.size() - done);
    if (count >= 0)
      done += static_cast<std::size_t>(count);
    else if (errno != EINTR)
      failure = errno;
  }
  if (failure == 0 && ::fsync(descriptor) != 0) failure = errno;
  if (::close(descriptor) != 0 && failure == 0) failure = errno;
  return failure;
}

// Makes the name of a new file survive a failure of the machine. Errors are ignored, because some file
// systems do not support it and the file is usable anyway.
void syncDirectory(const fs::path& directory) {
  const int descriptor = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

Bio bioOf(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

template <typename Write>
std::string toPem(const fs::path& file, Write write) {
  const Bio bio(BIO_new(BIO_s_mem()));
  if (!bio || write(bio.get()) != 1) fail(file, "the key cannot be converted");
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &data);
  return {data, static_cast<std::size_t>(size)};
}

std::string privatePem(const fs::path& file, EVP_PKEY* key) {
  return toPem(file, [&](BIO* bio) {
    return PEM_write_bio_PKCS8PrivateKey(bio, key, nullptr, nullptr, 0, nullptr, nullptr);
  });
}

bool isP256(const EVP_PKEY* key) {
  std::array<char, 64> group{};
  std::size_t size = 0;
  return EVP_PKEY_is_a(key, "EC") == 1 &&
         EVP_PKEY_get_group_name(key, group.data(), group.size(), &size) == 1 &&
         std::string_view(group.data(), size) == "prime256v1";
}

void readPem(const fs::path& file, TokenKey& key) {
  const std::string text = readFile(file);
  const auto noPassword = [](char*, int, int, void*) { return 0; };
  Key pair(PEM_read_bio_PrivateKey(bioOf(text).get(), nullptr, noPassword, nullptr));
  const bool isPrivate = pair != nullptr;
  if (!pair) pair.reset(PEM_read_bio_PUBKEY(bioOf(text).get(), nullptr, noPassword, nullptr));
  ERR_clear_error();
  if (!pair) fail(file, "has no public or private key in PEM form without a password");
  if (!isP256(pair.get()))
    fail(file,
         "is not a key of the curve P-256, which ES256 needs; make one with "
         "`clothstream-server token --new-key FILE.pem`");
  key.algorithm = Algorithm::es256;
  key.checking = toPem(file, [&](BIO* bio) { return PEM_write_bio_PUBKEY(bio, pair.get()); });
  if (isPrivate) key.signing = privatePem(file, pair.get());
}

void readSecret(const fs::path& file, TokenKey& key) {
  std::string secret = readFile(file);
  const std::size_t last = secret.find_last_not_of(" \r\n\t");
  secret.resize(last == std::string::npos ? 0 : last + 1);
  if (secret.size() < kMinSecretBytes)
    fail(file, fmt::format("has {} bytes; a secret needs at least {}", secret.size(), kMinSecretBytes));
  key.algorithm = Algorithm::hs256;
  key.checking = key.signing = std::move(secret);
}

}  // namespace

const char* nameOf(Algorithm algorithm) {
  return algorithm == Algorithm::es256 ? "ES256" : "HS256";
}

TokenKey readTokenKey(const fs::path& file) {
  TokenKey key;
  key.id = file.stem().string();
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-";
  if (key.id.empty() || key.id.size() > kMaxIdBytes ||
      key.id.find_first_not_of(kAllowed) != std::string::npos)
    fail(file, "the name of a key has 1 to 64 characters of A-Z, a-z, 0-9, '.', '_' and '-'");
  if (file.extension() == ".pem")
    readPem(file, key);
  else if (file.extension() == ".secret")
    readSecret(file, key);
  else
    fail(file, "the name of a key ends in .pem (ES256) or .secret (HS256)");
  key.digest = scene::hashOfToken(key.checking);
  struct stat status {};
  key.exposed = !key.signing.empty() && ::stat(file.c_str(), &status) == 0 &&
                (status.st_mode & (S_IRWXG | S_IRWXO)) != 0;
  return key;
}

TokenKeys readTokenKeys(const fs::path& directory) {
  std::error_code error;
  std::vector<fs::path> files;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error))
    if (entry->path().extension() == ".pem" || entry->path().extension() == ".secret")
      files.push_back(entry->path());
  if (error) fail(directory, fmt::format("cannot be read: {}", error.message()));
  std::ranges::sort(files);
  TokenKeys keys;
  for (const fs::path& file : files) {
    TokenKey key = readTokenKey(file);
    std::string id = key.id;
    if (!keys.emplace(std::move(id), std::move(key)).second)
      fail(file, "another key has the same name; rename one of them");
  }
  if (keys.empty())
    fail(directory, "has no key; make one with `clothstream-server token --new-key DIR/NAME.pem`");
  return keys;
}

void makeTokenKey(const fs::path& file) {
  std::string content;
  if (file.extension() == ".pem") {
    const Key pair(EVP_EC_gen("P-256"));
    if (!pair) fail(file, "the key cannot be made");
    content = privatePem(file, pair.get());
  } else if (file.extension() == ".secret") {
    content = randomHex(kNewSecretBytes) + "\n";
  } else {
    fail(file, "the name of a key ends in .pem (ES256) or .secret (HS256)");
  }
  fs::path draft = file;
  draft += fmt::format(".{}.draft", randomHex(kDraftBytes));
  const int written = writeFile(draft, content);
  OPENSSL_cleanse(content.data(), content.size());
  // Unlike a rename, a link does not replace a file.
  const int linked = written != 0 || ::link(draft.c_str(), file.c_str()) == 0 ? 0 : errno;
  ::unlink(draft.c_str());
  if (written != 0) fail(file, fmt::format("cannot be written: {}", std::strerror(written)));
  if (linked != 0) fail(file, fmt::format("cannot be made: {}", std::strerror(linked)));
  syncDirectory(file.has_parent_path() ? file.parent_path() : fs::path("."));
}

std::string randomHex(std::size_t bytes) {
  std::vector<unsigned char> random(bytes);
  if (RAND_bytes(random.data(), static_cast<int>(random.size())) != 1)
    throw std::runtime_error("the system has no random numbers");
  std::string text;
  for (const unsigned char byte : random) text += fmt::format("{:02x}", byte);
  return text;
}

}  // namespace clothstream::identity
