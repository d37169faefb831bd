// SPDX-License-Identifier: MIT
#include "clients/library/library_options.h"

#include <cstdint>
#include <filesystem>
#include <fstream>

#include "clients/library/library_transport.h"
#include "proto/tls/fingerprint.h"

namespace clothstream {
namespace {

std::string error(const clothstream_options& options) {
  if (options.role > CS_ROLE_OWNER)
    return "options->role is " + std::to_string(options.role) + "; allowed is a cs_role, 0 to " +
           std::to_string(CS_ROLE_OWNER) + ".";
  constexpr std::uint32_t kMost = 3;
  if (options.quality > kMost)
    return "options->quality is " + std::to_string(options.quality) + "; 0 to " + std::to_string(kMost) +
           " is allowed.";
  for (const char* text : {options.scene, options.client_name, options.display_name, options.token,
                           options.ca_file, options.fingerprint})
    if (!text)
      return "options->scene, client_name, display_name, token, ca_file or fingerprint is NULL; \"\" is "
             "allowed.";
  if (options.transport > CLOTHSTREAM_TRANSPORT_TCP)
    return "options->transport is " + std::to_string(options.transport) +
           "; allowed is a clothstream_transport, 0 to " + std::to_string(CLOTHSTREAM_TRANSPORT_TCP) + ".";
  if (options.transport == CLOTHSTREAM_TRANSPORT_DATAGRAMS && !kLibraryHasDatagrams)
    return "options->transport is CLOTHSTREAM_TRANSPORT_DATAGRAMS; this library is built without datagrams. "
           "Use CLOTHSTREAM_TRANSPORT_AUTO.";
  if (options.join_timeout_ms == 0) return "options->join_timeout_ms is 0; at least 1 is allowed.";
  return {};
}

}  // namespace

tl::expected<clothstream_options, std::string> readOptions(const clothstream_options* options) {
  if (!options) {
    clothstream_options defaults;
    clothstream_default_options(&defaults);
    return defaults;
  }
  if (options->version != CLOTHSTREAM_OPTIONS_VERSION)
    return tl::unexpected("options->version is " + std::to_string(options->version) +
                          "; this library accepts " + std::to_string(CLOTHSTREAM_OPTIONS_VERSION) +
                          ". Start from clothstream_default_options, with the header of this library.");
  if (std::string wrong = error(*options); !wrong.empty()) return tl::unexpected(std::move(wrong));
  return *options;
}

tl::expected<ServerAddress, std::string> readAddress(const char* address, const clothstream_options& options,
                                                     bool pairs) {
  if (!address) return tl::unexpected(std::string("The address is NULL."));
  auto completed = completeAddress(address, kLibraryEndpoint);
  if (!completed) return tl::unexpected(std::move(completed).error());
  ServerAddress server(std::move(*completed));
  server.token = options.token;
  server.caFile = options.ca_file;
  const std::string fingerprint = options.fingerprint;
  if ((pairs || !server.token.empty()) && !server.isEncrypted() && !server.isLoopback())
    return tl::unexpected(server.address + ": others in the network could read the " +
                          (pairs ? "pairing code" : "token") + " on its way to the server. Use https://" +
                          server.address + ", with TLS on the server (--tls self).");
  if (!server.caFile.empty() && !fingerprint.empty())
    return tl::unexpected(
        std::string("options->ca_file and options->fingerprint are both set; use one of them."));
  if (!server.isEncrypted() && !(server.caFile.empty() && fingerprint.empty()))
    return tl::unexpected("options->ca_file and options->fingerprint need TLS: use https://" +
                          server.address + ", or leave them empty.");
  const std::u8string caFile(server.caFile.begin(), server.caFile.end());
  if (!caFile.empty() && !std::ifstream(std::filesystem::path(caFile)))
    return tl::unexpected("options->ca_file: cannot read " + server.caFile + ".");
  if (!fingerprint.empty()) {
    auto normal = normalFingerprint(fingerprint);
    if (!normal)
      return tl::unexpected("options->fingerprint is \"" + fingerprint +
                            "\"; it must have 64 hexadecimal digits, as the server prints them.");
    server.fingerprint = std::move(*normal);
  }
  return server;
}

}  // namespace clothstream
