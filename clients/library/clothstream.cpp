// SPDX-License-Identifier: MIT
// The C interface over NativeClient.
#include <chrono>
#include <cstdint>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include <clothstream/clothstream.h>

#include "clients/library/allocation.h"
#include "clients/library/library_options.h"
#include "clients/library/library_transport.h"
#include "clients/native/native_client.h"
#include "clients/native/pairing.h"

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
  } catch (const std::invalid_argument& error) {
    return fail(CLOTHSTREAM_INVALID, error.what());
  } catch (const std::exception& error) {
    return fail(CLOTHSTREAM_FAILED, error.what());
  }
  return CLOTHSTREAM_FAILED;
}

NativeClientOptions clientOptions(const clothstream_options& options) {
  NativeClientOptions client;
  client.scene = options.scene;
  client.clientName = options.client_name;
  client.displayName = options.display_name;
  client.role = static_cast<cs_role>(options.role);
  client.quality = options.quality;
  client.joinTimeout = std::chrono::milliseconds(options.join_timeout_ms);
  client.acknowledgesSeen = true;
  client.reconnectFor = std::chrono::milliseconds(options.reconnect_for_ms);
  if (options.log != nullptr)
    client.onLog = [log = options.log, context = options.log_context](LogLevel level,
                                                                      const std::string& text) {
      log(context, static_cast<std::uint32_t>(level), text.c_str());
    };
  return client;
}

}  // namespace

void clothstream_default_options(clothstream_options* out) noexcept {
  *out = {.version = CLOTHSTREAM_OPTIONS_VERSION,
          .role = CS_ROLE_UNSPECIFIED,
          .quality = 0,
          .scene = "",
          .client_name = "libclothstream",
          .display_name = "",
          .join_timeout_ms = 10'000,
          .reconnect_for_ms = 60'000,
          .token = "",
          .ca_file = "",
          .fingerprint = "",
          .log = nullptr,
          .log_context = nullptr,
          .transport = CLOTHSTREAM_TRANSPORT_AUTO};
}

clothstream_result clothstream_open(const char* address, const clothstream_options* options,
                                    clothstream_stream** out) noexcept {
  return guarded([&] {
    *out = nullptr;
    const auto wanted = readOptions(options);
    if (!wanted) return fail(CLOTHSTREAM_INVALID, wanted.error());
    const auto server = readAddress(address, *wanted, false);
    if (!server) return fail(CLOTHSTREAM_INVALID, server.error());
    auto joined =
        NativeClient::join(*server, withLibraryDatagrams(makeLibraryTransport(*server), wanted->transport),
                           clientOptions(*wanted), [](cs_client*, std::uint32_t) {});
    if (!joined) return fail(joined.error());
    *out = std::make_unique<clothstream_stream>(clothstream_stream{std::move(*joined)}).release();
    return CLOTHSTREAM_OK;
  });
}

clothstream_result clothstream_pair(const char* address, const char* code, const clothstream_options* options,
                                    char* token, size_t token_bytes) noexcept {
  return guarded([&] {
    if (!code || !token) return fail(CLOTHSTREAM_INVALID, "The code or the token is NULL.");
    if (token_bytes < CLOTHSTREAM_TOKEN_BYTES)
      return fail(CLOTHSTREAM_INVALID, "token_bytes is too small; use CLOTHSTREAM_TOKEN_BYTES.");
    *token = '\0';
    if (*code == '\0')
      return fail(CLOTHSTREAM_INVALID,
                  "The pairing code is empty; use the six digits that the server shows.");
    const auto wanted = readOptions(options);
    if (!wanted) return fail(CLOTHSTREAM_INVALID, wanted.error());
    const auto server = readAddress(address, *wanted, true);
    if (!server) return fail(CLOTHSTREAM_INVALID, server.error());
    const std::unique_ptr<Transport> transport = makeLibraryTransport(*server);
    const auto given =
        pairOver(*transport, *server, code, std::chrono::milliseconds(wanted->join_timeout_ms));
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

int clothstream_get_datagram_statistics(clothstream_stream* stream, cs_datagram_statistics* out) noexcept {
  const auto datagrams = stream->client->datagrams();
  if (!datagrams || out->version != CS_DATAGRAM_STATISTICS_VERSION) return 0;
  *out = *datagrams;
  return 1;
}

clothstream_result clothstream_set_allocator(const clothstream_allocator* allocator) noexcept {
  return guarded([&] {
    if (allocator == nullptr || allocator->version != CLOTHSTREAM_ALLOCATOR_VERSION ||
        allocator->allocate == nullptr || allocator->release == nullptr)
      return fail(CLOTHSTREAM_INVALID,
                  "The allocator is NULL, has NULL functions, or its version is not "
                  "CLOTHSTREAM_ALLOCATOR_VERSION.");
    std::string wrong = useAllocator(*allocator);
    return wrong.empty() ? CLOTHSTREAM_OK : fail(CLOTHSTREAM_INVALID, std::move(wrong));
  });
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
