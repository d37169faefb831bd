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
#include <openssl/rand.h>
#include <openssl/x509.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/files/regular_file.h"
#include "server/files/state_directory.h"

namespace clothstream::tls {
namespace {

namespace fs = std::filesystem;

// Browsers do not accept much longer validity.
constexpr std::chrono::hours kValidity{397 * 24};
constexpr std::chrono::hours kRenewBefore{30 * 24};
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 20;

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
using Names = std::unique_ptr<GENERAL_NAMES, Freed<GENERAL_NAMES_free>>;

std::string opensslError() {
  std::array<char, 256> text{};
  ERR_error_string_n(ERR_get_error(), text.data(), text.size());
  ERR_clear_error();
  return text.data();
}

// Returns the result of an OpenSSL call, or throws if it has failed.
template <typename T>
T check(T result, const char* what) {
  if (!result) throw std::runtime_error(fmt::format("{}: {}", what, opensslError()));
  return result;
}

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

void addExtension(X509& certificate, int kind, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, &certificate, &certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>> extension(
      check(X509V3_EXT_nconf_nid(nullptr, &context, kind, value.c_str()), "extension of a certificate"));
  check(X509_add_ext(&certificate, extension.get(), -1), "extension of a certificate");
}

X509Certificate makeCertificate(EVP_PKEY& key, const std::vector<std::string>& names) {
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
  constexpr long kDay = 24 * 3600;  // clocks of clients may be behind
  check(X509_gmtime_adj(X509_getm_notBefore(&x509), -kDay), "certificate");
  check(X509_gmtime_adj(X509_getm_notAfter(&x509), std::chrono::seconds(kValidity).count() - kDay),
        "certificate");
  check(X509_set_pubkey(&x509, &key), "certificate");
  X509_NAME* const subject = X509_get_subject_name(&x509);
  constexpr std::string_view kSubject = "ClothStream";
  check(X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_ASC,
                                   reinterpret_cast<const unsigned char*>(kSubject.data()),
                                   static_cast<int>(kSubject.size()), -1, 0),
        "certificate");
  check(X509_set_issuer_name(&x509, subject), "certificate");
  std::vector<std::string> alternatives;
  for (const std::string& name : names) alternatives.push_back((isAddress(name) ? "IP:" : "DNS:") + name);
  addExtension(x509, NID_subject_alt_name, fmt::format("{}", fmt::join(alternatives, ",")));
  addExtension(x509, NID_basic_constraints, "critical,CA:FALSE");
  addExtension(x509, NID_key_usage, "critical,digitalSignature");
  addExtension(x509, NID_ext_key_usage, "serverAuth");
  check(X509_sign(&x509, &key, EVP_sha256()), "signature of a certificate");
  return certificate;
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
  if (!fs::exists(keyFile)) {
    const Key key(check(EVP_EC_gen("P-256"), "key"));
    writeFile(keyFile, toPem(*key), 0600);
  }
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
    chain = toPem(*makeCertificate(*key, names));
    writeFile(chainFile, chain, 0644);
  }
  return {std::move(chain), keyText};
}

}  // namespace clothstream::tls
