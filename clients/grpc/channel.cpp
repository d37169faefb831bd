// SPDX-License-Identifier: MIT
// Channel arguments and texts of failures.
#include "clients/grpc/channel.h"

#include <chrono>
#include <fstream>
#include <functional>
#include <mutex>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <grpcpp/security/tls_certificate_verifier.h>
#include <grpcpp/security/tls_credentials_options.h>

#include "clients/native/transport.h"
#include "proto/tls/fingerprint.h"

namespace clothstream {
namespace {

// Empty unless the text of gRPC is about the server's certificate.
std::string whyNotTrusted(const std::string& text) {
  constexpr std::string_view kShown = "the server has the fingerprint ";
  if (const std::size_t at = text.find(kShown); at != std::string::npos)
    return text.substr(at, text.find(')', at) - at) +
           ". If this is right, use it with --fingerprint; otherwise another server answers.";
  if (text.find("certificate verify failed") != std::string::npos)
    return "no known authority has signed its certificate. Use --ca FILE, or --fingerprint with what the "
           "server prints.";
  return {};
}

std::string inBrackets(const std::string& text) {
  return text.empty() ? text : fmt::format(" ({})", text);
}

// Longest time of a handshake without a call.
constexpr std::chrono::seconds kHandshakePatience{10};

// Fingerprint that a verifier has seen. gRPC's threads write it.
struct SeenFingerprint {
  std::mutex mutex;
  std::string text;
};

// Accepts only the server with this key. Names and dates of its certificate do not matter.
class FingerprintVerifier final : public grpc::experimental::ExternalCertificateVerifier {
 public:
  // `seen` may be null.
  explicit FingerprintVerifier(std::string fingerprint, std::shared_ptr<SeenFingerprint> seen = nullptr)
      : fingerprint_(std::move(fingerprint)), seen_(std::move(seen)) {}

  bool Verify(grpc::experimental::TlsCustomVerificationCheckRequest* request,
              std::function<void(grpc::Status)>, grpc::Status* status) override {
    const grpc::string_ref certificate = request->peer_cert();
    const auto shown = fingerprintOf({certificate.data(), certificate.size()});
    if (seen_ && shown) {
      const std::lock_guard lock(seen_->mutex);
      seen_->text = *shown;
    }
    *status = shown == fingerprint_
                  ? grpc::Status::OK
                  : grpc::Status(grpc::StatusCode::UNAUTHENTICATED,
                                 fmt::format("the server has the fingerprint {}", shown.value_or("none")));
    return true;  // the check is complete
  }
  void Cancel(grpc::experimental::TlsCustomVerificationCheckRequest*) override {}

 private:
  const std::string fingerprint_;
  const std::shared_ptr<SeenFingerprint> seen_;
};

std::shared_ptr<grpc::ChannelCredentials> trustOnly(const std::string& fingerprint,
                                                    std::shared_ptr<SeenFingerprint> seen = nullptr) {
  grpc::experimental::TlsChannelCredentialsOptions options;
  options.set_verify_server_certs(false);
  options.set_check_call_host(false);
  options.set_certificate_verifier(
      grpc::experimental::ExternalCertificateVerifier::Create<FingerprintVerifier>(fingerprint,
                                                                                   std::move(seen)));
  return grpc::experimental::TlsCredentials(options);
}

// Returns whether the handshake succeeds.
bool canConnect(grpc::Channel& channel) {
  const auto end = std::chrono::system_clock::now() + kHandshakePatience;
  for (;;) {
    const grpc_connectivity_state state = channel.GetState(true);
    if (state == GRPC_CHANNEL_READY) return true;
    if (state == GRPC_CHANNEL_TRANSIENT_FAILURE || state == GRPC_CHANNEL_SHUTDOWN) return false;
    if (!channel.WaitForStateChange(state, end)) return false;
  }
}

}  // namespace

std::shared_ptr<grpc::ChannelCredentials> credentialsOf(const ServerAddress& server) {
  if (!server.isEncrypted()) return grpc::InsecureChannelCredentials();
  if (!server.fingerprint.empty()) return trustOnly(server.fingerprint);
  grpc::SslCredentialsOptions options;
  if (!server.caFile.empty()) {
    std::ifstream file(server.caFile, std::ios::binary);
    std::ostringstream text;
    if (!file || !(text << file.rdbuf()))
      throw std::runtime_error(fmt::format("cannot read the certificates in {}", server.caFile));
    options.pem_root_certs = text.str();
  }
  return grpc::SslCredentials(options);
}

std::shared_ptr<grpc::Channel> makeChannel(const ServerAddress& server,
                                           const std::shared_ptr<grpc::ChannelCredentials>& credentials) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(static_cast<int>(kMaxServerMessageBytes));
  // A separate connection per client, so that two clients of a process do not share flow control.
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(server.hostAndPort(), credentials, arguments);
}

std::shared_ptr<grpc::Channel> makeChannel(const ServerAddress& server) {
  return makeChannel(server, credentialsOf(server));
}

tl::expected<std::string, Failure> unknownKeyOf(const ServerAddress& server) {
  if (canConnect(*makeChannel(server))) return std::string();
  const auto seen = std::make_shared<SeenFingerprint>();
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // No key is accepted, so the connection ends with the handshake.
  canConnect(*grpc::CreateCustomChannel(server.hostAndPort(), trustOnly({}, seen), arguments));
  const std::lock_guard lock(seen->mutex);
  if (seen->text.empty())
    return tl::unexpected(notJoined(server, {grpc::StatusCode::DEADLINE_EXCEEDED, "no TLS handshake"}));
  return seen->text;
}

void authorize(grpc::ClientContext& call, const ServerAddress& server) {
  if (!server.token.empty()) call.AddMetadata("authorization", "Bearer " + server.token);
}

Failure notJoined(const ServerAddress& server, const grpc::Status& status) {
  using Kind = Failure::Kind;
  switch (status.error_code()) {
    case grpc::StatusCode::UNAVAILABLE:
      if (const std::string why = whyNotTrusted(status.error_message()); !why.empty())
        return {Kind::refused,
                fmt::format("The server at {} is not the one expected: {}", server.address, why)};
      [[fallthrough]];
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      return {Kind::unreachable,
              fmt::format("No server answers at {}: is clothstream-server running there?{}", server.address,
                          inBrackets(status.error_message()))};
    case grpc::StatusCode::OK:
      return {Kind::refused,
              fmt::format("The server at {} ended the stream before it began.", server.address)};
    case grpc::StatusCode::UNIMPLEMENTED:
      return {Kind::refused, fmt::format("The server at {} is not a clothstream-server of this release{}.",
                                         server.address, inBrackets(status.error_message()))};
    case grpc::StatusCode::UNAUTHENTICATED:
      return {Kind::refused,
              fmt::format("The server at {} refuses: {}", server.address, status.error_message()), true};
    default:
      return {Kind::refused,
              fmt::format("The server at {} refuses: {}", server.address, status.error_message())};
  }
}

std::string addressIn(std::string_view peer) {
  const bool ipv6 = peer.starts_with("ipv6:");
  const std::size_t port = peer.rfind(':');
  constexpr std::size_t kScheme = 5;
  if ((!ipv6 && !peer.starts_with("ipv4:")) || port < kScheme) return {};
  std::string_view address = peer.substr(kScheme, port - kScheme);
  for (const auto& [open, close] : {std::pair<std::string_view, std::string_view>("[", "]"), {"%5B", "%5D"}})
    if (address.starts_with(open) && address.ends_with(close))
      address = address.substr(open.size(), address.size() - open.size() - close.size());
  return std::string(address);
}

Failure lost(const ServerAddress& server, const grpc::Status& status) {
  if (status.ok())
    return {Failure::Kind::lost, fmt::format("The server at {} ended the stream.", server.address)};
  return {Failure::Kind::lost,
          fmt::format("The stream from {} is lost{}.", server.address, inBrackets(status.error_message()))};
}

}  // namespace clothstream
