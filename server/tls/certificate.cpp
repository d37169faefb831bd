// SPDX-License-Identifier: MIT
#include "server/tls/certificate.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <arpa/inet.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include "proto/tls/openssl.h"
#include "proto/tls/self_signed.h"
#include "server/files/regular_file.h"
#include "server/files/state_directory.h"

namespace clothstream::tls {
namespace {

namespace fs = std::filesystem;

// Browsers do not accept much longer validity.
constexpr std::chrono::hours kValidity{397 * 24};
constexpr std::chrono::hours kRenewBefore{30 * 24};
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;

using Names = std::unique_ptr<GENERAL_NAMES, Freed<GENERAL_NAMES_free>>;

Bio bioOf(const std::string& text) {
  return Bio(check(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), "memory"));
}

std::string textOf(BIO& bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(&bio, &data);
  return {data, static_cast<std::size_t>(size)};
}

// Null if the text has none.
X509Certificate firstCertificate(const std::string& pem) {
  X509Certificate certificate(PEM_read_bio_X509(bioOf(pem).get(), nullptr, nullptr, nullptr));
  ERR_clear_error();
  return certificate;
}

// Null if the text has none that is not encrypted.
Key keyOf(const std::string& pem) {
  const auto noPassword = [](char*, int, int, void*) { return 0; };
  Key key(PEM_read_bio_PrivateKey(bioOf(pem).get(), nullptr, noPassword, nullptr));
  ERR_clear_error();
  return key;
}

std::string readFile(const fs::path& file) {
  auto text = files::readRegularFile(file, kMaxFileBytes);
  if (!text) throw std::runtime_error(fmt::format("{}: {}", file.string(), text.error().text));
  return std::move(*text);
}

// Replaces the file at once: a reader sees the old or the new content.
void writeFile(const fs::path& file, const std::string& content, mode_t mode) {
  const fs::path next = file.string() + ".new";
  const auto fail = [](const fs::path& path) {
    throw std::runtime_error(fmt::format("cannot write {}: {}", path.string(), std::strerror(errno)));
  };
  const int descriptor = ::open(next.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, mode);
  if (descriptor < 0) fail(next);
  const bool written =
      ::fchmod(descriptor, mode) == 0 &&
      ::write(descriptor, content.data(), content.size()) == static_cast<ssize_t>(content.size()) &&
      ::fsync(descriptor) == 0;
  if (::close(descriptor) != 0 || !written) fail(next);
  if (::rename(next.c_str(), file.c_str()) != 0) fail(file);
}

std::string toPem(EVP_PKEY& key) {
  const Bio bio(check(BIO_new(BIO_s_mem()), "memory"));
  check(PEM_write_bio_PKCS8PrivateKey(bio.get(), &key, nullptr, nullptr, 0, nullptr, nullptr), "key");
  return textOf(*bio);
}

std::string toPem(X509& certificate) {
  const Bio bio(check(BIO_new(BIO_s_mem()), "memory"));
  check(PEM_write_bio_X509(bio.get(), &certificate), "certificate");
  return textOf(*bio);
}

bool isAddress(const std::string& name) {
  std::array<unsigned char, sizeof(in6_addr)> ignored{};
  return ::inet_pton(AF_INET, name.c_str(), ignored.data()) == 1 ||
         ::inet_pton(AF_INET6, name.c_str(), ignored.data()) == 1;
}

// Certificate of a server with these host names and IP addresses.
X509Certificate makeServerCertificate(EVP_PKEY& key, const std::vector<std::string>& names) {
  std::vector<std::string> alternatives;
  for (const std::string& name : names) alternatives.push_back((isAddress(name) ? "IP:" : "DNS:") + name);
  return makeCertificate(key, kValidity, fmt::format("{}", fmt::join(alternatives, ",")));
}

bool hasName(X509& certificate, const std::string& name) {
  return isAddress(name) ? X509_check_ip_asc(&certificate, name.c_str(), 0) == 1
                         : X509_check_host(&certificate, name.c_str(), name.size(), 0, nullptr) == 1;
}

std::chrono::system_clock::time_point expiryOf(X509& certificate) {
  std::tm end{};
  check(ASN1_TIME_to_tm(X509_get0_notAfter(&certificate), &end), "certificate");
  return std::chrono::system_clock::from_time_t(::timegm(&end));
}

// Returns whether the text is allowed in a list of alternative names.
bool isDnsName(const std::string& name) {
  return !name.empty() && name.size() < 254 && std::ranges::all_of(name, [](unsigned char letter) {
    return std::isalnum(letter) || letter == '-' || letter == '.';
  });
}

}  // namespace

Certificate readCertificate(const fs::path& chain, const fs::path& key) {
  Certificate certificate{readFile(chain), readFile(key)};
  const X509Certificate first = firstCertificate(certificate.chain);
  if (!first) throw std::runtime_error(fmt::format("{} has no certificate in PEM format", chain.string()));
  const Key privateKey = keyOf(certificate.key);
  if (!privateKey)
    throw std::runtime_error(
        fmt::format("{} has no private key in PEM format, or one with a password", key.string()));
  const bool matches = X509_check_private_key(first.get(), privateKey.get()) == 1;
  ERR_clear_error();
  if (!matches)
    throw std::runtime_error(
        fmt::format("{} is not the key of the first certificate in {}", key.string(), chain.string()));
  return certificate;
}

bool othersMayRead(const fs::path& key) {
  constexpr mode_t kOthers = S_IRGRP | S_IROTH;
  struct stat file {};
  return ::stat(key.c_str(), &file) == 0 && (file.st_mode & kOthers) != 0;
}

std::string readCertificates(const fs::path& file) {
  std::string text = readFile(file);
  if (!firstCertificate(text))
    throw std::runtime_error(fmt::format("{} has no certificate in PEM format", file.string()));
  return text;
}

std::chrono::system_clock::time_point expiryOf(const Certificate& certificate) {
  const X509Certificate first = firstCertificate(certificate.chain);
  if (!first) throw std::runtime_error("the text has no certificate in PEM format");
  return expiryOf(*first);
}

bool covers(const Certificate& certificate, const std::string& name) {
  const X509Certificate first = firstCertificate(certificate.chain);
  return first && hasName(*first, name);
}

std::vector<std::string> namesOf(const Certificate& certificate) {
  const X509Certificate first = firstCertificate(certificate.chain);
  if (!first) return {};
  std::vector<std::string> names;
  const Names all(
      static_cast<GENERAL_NAMES*>(X509_get_ext_d2i(first.get(), NID_subject_alt_name, nullptr, nullptr)));
  for (int i = 0; all && i < sk_GENERAL_NAME_num(all.get()); ++i) {
    int kind = 0;
    const void* value = GENERAL_NAME_get0_value(sk_GENERAL_NAME_value(all.get(), i), &kind);
    if (kind != GEN_DNS && kind != GEN_IPADD) continue;
    const auto* string = static_cast<const ASN1_STRING*>(value);
    const unsigned char* bytes = ASN1_STRING_get0_data(string);
    const int size = ASN1_STRING_length(string);
    std::array<char, INET6_ADDRSTRLEN> text{};
    if (kind == GEN_DNS)
      names.emplace_back(bytes, bytes + size);
    else if ((size == 4 || size == 16) &&
             ::inet_ntop(size == 4 ? AF_INET : AF_INET6, bytes, text.data(), text.size()) != nullptr)
      names.emplace_back(text.data());
  }
  return names;
}

std::vector<std::string> namesOfThisMachine() {
  std::vector<std::string> names{"localhost"};
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) == 0 && isDnsName(host.data())) {
    const std::string name = host.data();
    names.push_back(name);
    if (name.find('.') == std::string::npos) names.push_back(name + ".local");
  }
  ifaddrs* interfaces = nullptr;
  if (::getifaddrs(&interfaces) != 0) return names;
  for (const ifaddrs* entry = interfaces; entry != nullptr; entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || (entry->ifa_flags & IFF_UP) == 0) continue;
    std::array<char, INET6_ADDRSTRLEN> text{};
    const void* address = nullptr;
    if (entry->ifa_addr->sa_family == AF_INET)
      address = &reinterpret_cast<const sockaddr_in*>(entry->ifa_addr)->sin_addr;
    if (entry->ifa_addr->sa_family == AF_INET6) {
      const in6_addr& v6 = reinterpret_cast<const sockaddr_in6*>(entry->ifa_addr)->sin6_addr;
      if (!IN6_IS_ADDR_LINKLOCAL(&v6)) address = &v6;  // browsers cannot name their interface
    }
    if (address == nullptr ||
        ::inet_ntop(entry->ifa_addr->sa_family, address, text.data(), text.size()) == nullptr)
      continue;
    if (std::ranges::find(names, text.data()) == names.end()) names.emplace_back(text.data());
  }
  ::freeifaddrs(interfaces);
  return names;
}

Certificate selfSigned(const fs::path& directory, const std::vector<std::string>& names) {
  if (const auto made = files::makeStateDirectory(directory); !made)
    throw std::runtime_error(fmt::format("{}: {}", directory.string(), made.error()));
  const fs::path keyFile = directory / "self.key", chainFile = directory / "self.pem";
  if (!fs::exists(keyFile)) writeFile(keyFile, toPem(*makeKey()), 0600);
  const std::string keyText = readFile(keyFile);
  const Key key = keyOf(keyText);
  if (!key)
    throw std::runtime_error(
        fmt::format("{} has no private key: delete it to get a new key; clients then need its fingerprint",
                    keyFile.string()));
  std::string chain = fs::exists(chainFile) ? readFile(chainFile) : "";
  const X509Certificate old = firstCertificate(chain);
  const bool usable = old && X509_check_private_key(old.get(), key.get()) == 1 &&
                      expiryOf(*old) > std::chrono::system_clock::now() + kRenewBefore &&
                      std::ranges::all_of(names, [&](const auto& name) { return hasName(*old, name); });
  ERR_clear_error();
  if (!usable) {
    chain = toPem(*makeServerCertificate(*key, names));
    writeFile(chainFile, chain, 0644);
  }
  return {std::move(chain), keyText};
}

}  // namespace clothstream::tls
