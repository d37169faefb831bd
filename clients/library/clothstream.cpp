// SPDX-License-Identifier: MIT
// The C interface over NativeClient.
#include "clients/library/clothstream.h"

#include <chrono>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include "clients/grpc/grpc_client.h"
#include "clients/grpc/identity.h"
#include "clients/native/address.h"

using namespace clothstream;

struct clothstream_stream {
  std::unique_ptr<NativeClient> client;
};

namespace {

thread_local std::string errorText;

clothstream_result fail(clothstream_result result, std::string text) {
  errorText = std::move(text);
  return result;
}

clothstream_result fail(const Failure& failure) {
  switch (failure.kind) {
    case Failure::Kind::unreachable:
      return fail(CLOTHSTREAM_UNREACHABLE, failure.text);
    case Failure::Kind::refused:
      return fail(CLOTHSTREAM_REFUSED, failure.text);
    case Failure::Kind::lost:
      break;
  }
  return fail(CLOTHSTREAM_LOST, failure.text);
}

// Runs `body` and converts exceptions to results.
template <typename Body>
clothstream_result guarded(Body body) noexcept {
  try {
    errorText.clear();
    return body();
  } catch (const std::bad_alloc&) {
    errorText = "no memory";  // short enough to need no allocation
  } catch (const std::exception& error) {
    return fail(CLOTHSTREAM_FAILED, error.what());
  }
  return CLOTHSTREAM_FAILED;
}

// Returns what is wrong with the options; empty if they are valid.
std::string optionsError(const clothstream_options& options) {
  if (options.version != CLOTHSTREAM_OPTIONS_VERSION)
    return "options->version is " + std::to_string(options.version) + "; this library accepts version " +
           std::to_string(CLOTHSTREAM_OPTIONS_VERSION) +
           ". Start from clothstream_default_options, with the header of this library.";
  if (options.role > CS_ROLE_OWNER)
    return "options->role is " + std::to_string(options.role) + "; allowed is a cs_role, 0 to " +
           std::to_string(CS_ROLE_OWNER) + ".";
  constexpr std::uint32_t kMost = 3;
  if (options.quality > kMost || options.temporal_layers > kMost)
    return "options->quality is " + std::to_string(options.quality) + " and temporal_layers " +
           std::to_string(options.temporal_layers) + "; 0 to " + std::to_string(kMost) +
           " is allowed for both.";
  if (!options.scene || !options.client_name || !options.display_name)
    return "options->scene, client_name or display_name is NULL; \"\" is allowed.";
  if (options.join_timeout_ms == 0) return "options->join_timeout_ms is 0; at least 1 is allowed.";
  return {};
}

}  // namespace

void clothstream_default_options(clothstream_options* out) noexcept {
  *out = {.version = CLOTHSTREAM_OPTIONS_VERSION,
          .role = CS_ROLE_UNSPECIFIED,
          .quality = 0,
          .temporal_layers = 0,
          .scene = "",
          .client_name = "libclothstream",
          .display_name = "",
          .join_timeout_ms = 10'000,
          .reconnect_for_ms = 60'000};
}

clothstream_result clothstream_open(const char* address, const clothstream_options* options,
                                    clothstream_stream** out) noexcept {
  return clothstream_open_with_token(address, "", options, out);
}

clothstream_result clothstream_open_with_token(const char* address, const char* token,
                                               const clothstream_options* options,
                                               clothstream_stream** out) noexcept {
  return guarded([&] {
    *out = nullptr;
    if (!address) return fail(CLOTHSTREAM_INVALID, "The address is NULL.");
    if (!token) return fail(CLOTHSTREAM_INVALID, "The token is NULL; \"\" is allowed.");
    const auto completed = completeAddress(address);
    if (!completed) return fail(CLOTHSTREAM_INVALID, completed.error());
    clothstream_options wanted;
    clothstream_default_options(&wanted);
    if (options) {
      if (std::string wrong = optionsError(*options); !wrong.empty())
        return fail(CLOTHSTREAM_INVALID, std::move(wrong));
      wanted = *options;
    }
    NativeClientOptions clientOptions;
    clientOptions.scene = wanted.scene;
    clientOptions.clientName = wanted.client_name;
    clientOptions.displayName = wanted.display_name;
    clientOptions.role = static_cast<cs_role>(wanted.role);
    clientOptions.quality = wanted.quality;
    clientOptions.temporalLayers = wanted.temporal_layers;
    clientOptions.joinTimeout = std::chrono::milliseconds(wanted.join_timeout_ms);
    clientOptions.reconnectFor = std::chrono::milliseconds(wanted.reconnect_for_ms);
    ServerAddress server(*completed);
    server.token = token;
    auto joined = joinByGrpc(server, clientOptions, [](cs_client*, std::uint32_t) {});
    if (!joined) return fail(joined.error());
    *out = std::make_unique<clothstream_stream>(clothstream_stream{std::move(*joined)}).release();
    return CLOTHSTREAM_OK;
  });
}

clothstream_result clothstream_pair(const char* address, const char* code, char* token,
                                    size_t token_bytes) noexcept {
  return guarded([&] {
    if (!address || !code || !token) return fail(CLOTHSTREAM_INVALID, "An argument is NULL.");
    if (token_bytes < CLOTHSTREAM_TOKEN_BYTES)
      return fail(CLOTHSTREAM_INVALID, "token_bytes is too small; use CLOTHSTREAM_TOKEN_BYTES.");
    *token = '\0';
    const auto completed = completeAddress(address);
    if (!completed) return fail(CLOTHSTREAM_INVALID, completed.error());
    const auto given = pair(*completed, code);
    if (!given) return fail(given.error());
    if (given->size() >= token_bytes) return fail(CLOTHSTREAM_REFUSED, "The server's token is too large.");
    std::memcpy(token, given->c_str(), given->size() + 1);
    return CLOTHSTREAM_OK;
  });
}

void clothstream_close(clothstream_stream* stream) noexcept {
  delete stream;
}

clothstream_result clothstream_wait(clothstream_stream* stream, uint32_t timeout_ms,
                                    uint32_t* events) noexcept {
  return guarded([&] {
    *events = stream->client->wait(std::chrono::milliseconds(timeout_ms));
    const std::optional<Failure> ended = stream->client->ended();
    return ended ? fail(*ended) : CLOTHSTREAM_OK;
  });
}

cs_client* clothstream_acquire(clothstream_stream* stream) noexcept {
  return stream->client->lock();
}

void clothstream_release(clothstream_stream* stream) noexcept {
  stream->client->unlock();
}

uint64_t clothstream_now_us(void) noexcept {
  return NativeClient::nowUs();
}

const char* clothstream_error_text(void) noexcept {
  return errorText.c_str();
}

const char* clothstream_version(void) noexcept {
  return CLOTHSTREAM_VERSION;
}
