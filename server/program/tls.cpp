// SPDX-License-Identifier: MIT
#include "server/program/tls.h"

#include <chrono>
#include <exception>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <spdlog/spdlog.h>

#include "server/tls/certificate.h"

namespace clothstream::program {
namespace {

// Names and addresses that a certificate of the server's own has.
std::vector<std::string> namesOf(const NetworkOptions& network) {
  std::vector<std::string> names = tls::namesOfThisMachine();
  for (const std::string& name : network.publicNames)
    if (name != "*") names.push_back(name);
  return names;
}

}  // namespace

std::shared_ptr<tls::ServerTls> openTls(const ServeOptions& options) {
  std::string clientCa;
  if (!options.tls.clientCa.empty()) clientCa = tls::readCertificates(options.tls.clientCa);
  if (options.tls.self) {
    if (options.state.directory.empty())
      throw std::runtime_error("--tls self needs a directory for its key: use --state-dir DIR");
    return std::make_shared<tls::ServerTls>(
        [directory = options.state.directory / "tls", names = namesOf(options.network)] {
          return tls::selfSigned(directory, names);
        },
        std::move(clientCa));
  }
  if (options.tls.certificate.empty()) return nullptr;
  if (tls::othersMayRead(options.tls.key))
    spdlog::warn("--tls-key: other accounts of this machine may read {}; use chmod 600",
                 options.tls.key.string());
  return std::make_shared<tls::ServerTls>(
      [chain = options.tls.certificate, key = options.tls.key] {
        tls::Certificate certificate = tls::readCertificate(chain, key);
        if (tls::expiryOf(certificate) < std::chrono::system_clock::now())
          spdlog::warn("the certificate in {} has expired; clients will refuse it", chain.string());
        return certificate;
      },
      std::move(clientCa));
}

void reload(tls::ServerTls& tls) {
  try {
    tls.reload();
    spdlog::info("the certificate is read again");
  } catch (const std::exception& failure) {
    spdlog::error("the old certificate stays in use: {}", failure.what());
  }
}

}  // namespace clothstream::program
