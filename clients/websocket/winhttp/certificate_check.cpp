// SPDX-License-Identifier: MIT
// Certificates by the functions of crypt32.
#include "clients/websocket/winhttp/certificate_check.h"

#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <boost/asio/ip/address.hpp>
#include <winhttp.h>

#include "clients/websocket/winhttp/windows_text.h"
#include "proto/tls/fingerprint.h"

namespace clothstream {
namespace {

template <typename Freed>
struct LocalFreed {
  void operator()(Freed* memory) const { LocalFree(memory); }
};

void closeStore(HCERTSTORE store) {
  if (store) CertCloseStore(store, 0);
}

void closeEngine(HCERTCHAINENGINE engine) {
  CertFreeCertificateChainEngine(engine);
}

// Adds the certificates of a PEM text to the store. Returns how many there were, or 0 if one is not readable.
int addCertificates(std::string_view pem, HCERTSTORE store) {
  constexpr std::string_view kBegin = "-----BEGIN CERTIFICATE-----", kEnd = "-----END CERTIFICATE-----";
  int count = 0;
  for (auto at = pem.find(kBegin); at != std::string_view::npos; at = pem.find(kBegin, at)) {
    const auto end = pem.find(kEnd, at);
    if (end == std::string_view::npos) return 0;
    const std::string_view text = pem.substr(at, end + kEnd.size() - at);
    std::vector<BYTE> der(text.size());
    DWORD bytes = static_cast<DWORD>(der.size());
    if (!CryptStringToBinaryA(text.data(), static_cast<DWORD>(text.size()), CRYPT_STRING_BASE64HEADER,
                              der.data(), &bytes, nullptr, nullptr) ||
        !CertAddEncodedCertificateToStore(store, X509_ASN_ENCODING, der.data(), bytes, CERT_STORE_ADD_ALWAYS,
                                          nullptr))
      return 0;
    at = end;
    ++count;
  }
  return count;
}

std::string keyOf(const CERT_CONTEXT& certificate) {
  BYTE* encoded = nullptr;
  DWORD bytes = 0, digestBytes = std::tuple_size_v<KeyDigest>;
  if (!CryptEncodeObjectEx(X509_ASN_ENCODING, X509_PUBLIC_KEY_INFO,
                           &certificate.pCertInfo->SubjectPublicKeyInfo, CRYPT_ENCODE_ALLOC_FLAG, nullptr,
                           &encoded, &bytes))
    return {};
  const std::unique_ptr<BYTE, LocalFreed<BYTE>> owner(encoded);
  KeyDigest digest{};
  if (!CryptHashCertificate2(L"SHA256", 0, nullptr, encoded, bytes, digest.data(), &digestBytes)) return {};
  return fingerprintText(digest);
}

// Whether the certificate is for this IP address, which crypt32 does not compare.
bool namesAddress(const CERT_CONTEXT& certificate, std::string_view address) {
  const CERT_INFO& info = *certificate.pCertInfo;
  const CERT_EXTENSION* const extension =
      CertFindExtension(szOID_SUBJECT_ALT_NAME2, info.cExtension, info.rgExtension);
  if (!extension) return false;
  CERT_ALT_NAME_INFO* names = nullptr;
  DWORD bytes = 0;
  if (!CryptDecodeObjectEx(X509_ASN_ENCODING, X509_ALTERNATE_NAME, extension->Value.pbData,
                           extension->Value.cbData, CRYPT_DECODE_ALLOC_FLAG, nullptr, &names, &bytes))
    return false;
  const std::unique_ptr<CERT_ALT_NAME_INFO, LocalFreed<CERT_ALT_NAME_INFO>> owner(names);
  for (DWORD i = 0; i < names->cAltEntry; ++i) {
    const CERT_ALT_NAME_ENTRY& entry = names->rgAltEntry[i];
    if (entry.dwAltNameChoice == CERT_ALT_NAME_IP_ADDRESS &&
        std::string_view(reinterpret_cast<const char*>(entry.IPAddress.pbData), entry.IPAddress.cbData) ==
            address)
      return true;
  }
  return false;
}

// Bytes of an IP address as certificates have them; empty for a name.
std::string addressBytes(const std::string& host) {
  boost::system::error_code isName;
  const auto address = boost::asio::ip::make_address(host, isName);
  if (isName) return {};
  if (address.is_v4()) {
    const auto bytes = address.to_v4().to_bytes();
    return {bytes.begin(), bytes.end()};
  }
  const auto bytes = address.to_v6().to_bytes();
  return {bytes.begin(), bytes.end()};
}

}  // namespace

CertificateCheck::CertificateCheck(const ServerAddress& server)
    : fingerprint_(server.fingerprint), host_(utf16(server.host())), address_(addressBytes(server.host())) {
  if (!fingerprint_.empty() || server.caFile.empty()) return;
  std::ifstream file(std::filesystem::path(utf16(server.caFile)), std::ios::binary);
  const std::string pem{std::istreambuf_iterator<char>(file), {}};
  authorities_.reset(CertOpenStore(CERT_STORE_PROV_MEMORY, 0, 0, 0, nullptr), &closeStore);
  if (!authorities_ || addCertificates(pem, authorities_.get()) == 0)
    throw std::invalid_argument("cannot read the certificates in " + server.caFile +
                                ": it must be a PEM file with at least one certificate");
  CERT_CHAIN_ENGINE_CONFIG config{};
  // Without the member that Windows 8 has added, which Wine does not know.
  config.cbSize = offsetof(CERT_CHAIN_ENGINE_CONFIG, dwExclusiveFlags);
  config.hExclusiveRoot = authorities_.get();
  HCERTCHAINENGINE engine = nullptr;
  if (!CertCreateCertificateChainEngine(&config, &engine))
    throw std::invalid_argument("cannot use the certificates in " + server.caFile + ": " +
                                windowsErrorText(GetLastError()));
  engine_.reset(engine, &closeEngine);
}

CertificateCheck CertificateCheck::at(const std::string& host) const {
  CertificateCheck other = *this;
  other.host_ = utf16(host);
  other.address_ = addressBytes(host);
  return other;
}

CertificateCheck::Result CertificateCheck::check(const CERT_CONTEXT& certificate) const {
  Result result;
  result.shownKey = keyOf(certificate);
  if (!fingerprint_.empty()) {
    result.trusted = result.shownKey == fingerprint_;
    return result;
  }
  const DWORD error = chainError(certificate);
  result.trusted = error == ERROR_SUCCESS;
  if (!result.trusted) result.why = windowsErrorText(error);
  return result;
}

DWORD CertificateCheck::chainError(const CERT_CONTEXT& certificate) const {
  char serverUsage[] = szOID_PKIX_KP_SERVER_AUTH;
  std::array<LPSTR, 1> usages{serverUsage};
  CERT_CHAIN_PARA wanted{};
  wanted.cbSize = sizeof wanted;
  wanted.RequestedUsage.dwType = USAGE_MATCH_TYPE_AND;
  wanted.RequestedUsage.Usage = {static_cast<DWORD>(usages.size()), usages.data()};
  // The store of the certificate has the others that the server has sent.
  PCCERT_CHAIN_CONTEXT chain = nullptr;
  if (!CertGetCertificateChain(engine_.get(), &certificate, nullptr, certificate.hCertStore, &wanted,
                               engine_ ? CERT_CHAIN_CACHE_ONLY_URL_RETRIEVAL : 0, nullptr, &chain))
    return GetLastError();
  const std::unique_ptr<const CERT_CHAIN_CONTEXT, void (*)(PCCERT_CHAIN_CONTEXT)> owner(
      chain, [](PCCERT_CHAIN_CONTEXT freed) { CertFreeCertificateChain(freed); });

  std::wstring host = host_;
  SSL_EXTRA_CERT_CHAIN_POLICY_PARA tls{};
  tls.cbSize = sizeof tls;
  tls.dwAuthType = AUTHTYPE_SERVER;
  tls.fdwChecks = address_.empty() ? 0 : SECURITY_FLAG_IGNORE_CERT_CN_INVALID;
  tls.pwszServerName = host.data();
  CERT_CHAIN_POLICY_PARA policy{};
  policy.cbSize = sizeof policy;
  policy.pvExtraPolicyPara = &tls;
  CERT_CHAIN_POLICY_STATUS status{};
  status.cbSize = sizeof status;
  if (!CertVerifyCertificateChainPolicy(CERT_CHAIN_POLICY_SSL, chain, &policy, &status))
    return GetLastError();
  if (status.dwError == ERROR_SUCCESS && !address_.empty() && !namesAddress(certificate, address_))
    return static_cast<DWORD>(CERT_E_CN_NO_MATCH);
  return status.dwError;
}

}  // namespace clothstream
