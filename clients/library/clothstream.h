/* SPDX-License-Identifier: MIT
 * C interface of the native client library: the client core (core.h) with a network connection.
 *
 * clothstream_open joins a scene. From then on a thread of the library sends and receives messages, decodes
 * frames, keeps the clock, and reconnects after a loss. Between clothstream_acquire and clothstream_release
 * that thread waits, and the caller may use the cs_client: its data does not change, so positions, normals
 * and triangles can be read without a copy. All functions of core.h are allowed, except those for programs
 * with their own connection: cs_create, cs_want, cs_destroy, cs_set_clock, cs_receive, cs_update,
 * cs_next_outgoing, cs_connecting, cs_disconnected, cs_follow_redirects, cs_offer_datagrams.
 *
 * Threads: all functions may be called from any thread. On one stream, clothstream_close must be the last
 * call, and the thread that acquired must release. Acquire only as long as copying or drawing takes: no
 * message is processed meanwhile, and a stream that is acquired for seconds loses its connection. Do not call
 * clothstream_acquire, clothstream_wait or clothstream_close on a stream that the same thread has acquired.
 * Do not use the library in a child process after fork() without exec().
 *
 * Lockstep (`clothstream-server play --lockstep`): the server sends the next frame when the program has seen
 * the last one. That is the next call of clothstream_wait after the one that reported CS_EVENT_FRAME. In a
 * program that never calls clothstream_wait, it is clothstream_release.
 *
 * Times are microseconds of clothstream_now_us. Strings are UTF-8. No exception leaves the library. If memory
 * runs out while a stream runs, the program ends.
 */
#ifndef CLOTHSTREAM_CLIENTS_LIBRARY_CLOTHSTREAM_H
#define CLOTHSTREAM_CLIENTS_LIBRARY_CLOTHSTREAM_H

#include <clothstream/core.h>

#ifdef __cplusplus
extern "C" {
#endif

/* NOLINTBEGIN(modernize-use-using): C has no using. */
typedef struct clothstream_stream clothstream_stream;

#define CLOTHSTREAM_TOKEN_BYTES 4097u /* buffer of clothstream_pair */

typedef enum clothstream_result {
  CLOTHSTREAM_OK = 0,
  CLOTHSTREAM_INVALID = 1,     /* an argument is not allowed */
  CLOTHSTREAM_UNREACHABLE = 2, /* no answer from the address, or not in time */
  CLOTHSTREAM_REFUSED = 3,     /* by the server: unknown scene, wrong version, full, removed */
  CLOTHSTREAM_LOST = 4,        /* the stream ended and could not be resumed */
  CLOTHSTREAM_FAILED = 5       /* out of memory or threads */
} clothstream_result;

/* Severity of a line of the log. */
typedef enum clothstream_log_level {
  CLOTHSTREAM_LOG_INFO = 1, /* joined, reconnected, left; notices of the server */
  CLOTHSTREAM_LOG_WARNING =
      2,                    /* a lost connection, a failed attempt to reconnect, an error that ends nothing */
  CLOTHSTREAM_LOG_ERROR = 3 /* why the stream ended */
} clothstream_log_level;

/* How frames and input travel (docs/transport.md). */
typedef enum clothstream_transport {
  CLOTHSTREAM_TRANSPORT_AUTO = 0,      /* in datagrams (UDP) if the server and the network allow them */
  CLOTHSTREAM_TRANSPORT_DATAGRAMS = 1, /* likewise; clothstream_open fails if they cannot be opened */
  CLOTHSTREAM_TRANSPORT_TCP = 2        /* never in datagrams */
} clothstream_transport;

#define CLOTHSTREAM_OPTIONS_VERSION 3u
typedef struct clothstream_options {
  uint32_t version CS_INIT(CLOTHSTREAM_OPTIONS_VERSION);
  uint32_t role; /* requested cs_role */
  /* Best quality level, 0 (finest) to 3, as in cs_want. cs_get_quality returns what the server sends. */
  uint32_t quality;
  const char* scene;        /* "" means the server's default scene */
  const char* client_name;  /* name of the program */
  const char* display_name; /* name for other participants; may be "" */
  uint32_t join_timeout_ms; /* at least 1 */
  /* How long to try to reconnect after a loss. 0 means the stream ends with its connection. */
  uint32_t reconnect_for_ms;
  /* Proof for a server that requires a token (docs/identity.md); "" means none. It is sent to other machines
   * only with TLS. */
  const char* token;
  /* With TLS: the server's certificate must be signed by an authority in this PEM file, for the name in the
   * address. "" means the authorities of the system. */
  const char* ca_file;
  /* With TLS, instead of an authority: the server must have the key with this fingerprint, as a server with
   * --tls self prints it: 64 hexadecimal digits, with or without colons. "" means none. */
  const char* fingerprint;
  /* Gets the log of the stream, line by line, on the library's thread; level is a clothstream_log_level. text
   * is one line without a line break, and valid during the call. It must not call functions of the library.
   * NULL means no log. */
  void (*log)(void* context, uint32_t level, const char* text);
  void* log_context; /* argument of log */
  /* clothstream_transport. A library for Windows has no datagrams: it refuses
   * CLOTHSTREAM_TRANSPORT_DATAGRAMS. */
  uint32_t transport;
} clothstream_options;

/* Fills in the version and the defaults: client_name "libclothstream", other strings "", role unspecified,
 * the whole stream, 10 s to join, 60 s to reconnect, no log, CLOTHSTREAM_TRANSPORT_AUTO. */
void clothstream_default_options(clothstream_options* out) CS_NOEXCEPT;

/* Joins a scene. Returns when the description of the scene has arrived.
 * address: HOST or HOST:PORT of the server's page; the default port is 8080. wss:// or https:// before it
 * means TLS, ws:// or http:// means no TLS and is the default. (A library built for gRPC: the gRPC endpoint,
 * port 50051, and only https://.)
 * options: NULL means the defaults. Strings are copied.
 * *out: the stream; NULL unless the result is CLOTHSTREAM_OK. Free it with clothstream_close. */
clothstream_result clothstream_open(const char* address, const clothstream_options* options,
                                    clothstream_stream** out) CS_NOEXCEPT;
/* Exchanges a pairing code, six digits that a server or an owner shows, for a token. Joins no scene.
 * address: as above. options: ca_file, fingerprint and join_timeout_ms are used; NULL means the defaults.
 * token: buffer of token_bytes, at least CLOTHSTREAM_TOKEN_BYTES; gets the token, which ends with a zero, or
 * "". Keep the token secret. The code is sent to other machines only with TLS. */
clothstream_result clothstream_pair(const char* address, const char* code, const clothstream_options* options,
                                    char* token, size_t token_bytes) CS_NOEXCEPT;
/* Leaves the scene and frees the stream. Takes at most half a second. NULL is allowed. */
void clothstream_close(clothstream_stream* stream) CS_NOEXCEPT;

/* Waits until something has changed since the last call, the stream has ended, or timeout_ms have passed. The
 * first call also reports the changes of clothstream_open. *events: the CS_EVENT bits of all changes. Returns
 * CLOTHSTREAM_OK while the stream runs, else why it ended. The data received until then can still be read. */
clothstream_result clothstream_wait(clothstream_stream* stream, uint32_t timeout_ms,
                                    uint32_t* events) CS_NOEXCEPT;

/* Stops the library's thread and returns the client, which belongs to the stream. Requests made while the
 * stream is acquired are sent after clothstream_release. */
cs_client* clothstream_acquire(clothstream_stream* stream) CS_NOEXCEPT;
void clothstream_release(clothstream_stream* stream) CS_NOEXCEPT;

/* Figures of the datagrams, summed over all connections of the stream. Returns 1, or 0 if no datagrams were
 * open or `out->version` is unknown. Also allowed while the stream is acquired. */
int clothstream_get_datagram_statistics(clothstream_stream* stream, cs_datagram_statistics* out) CS_NOEXCEPT;

#define CLOTHSTREAM_ALLOCATOR_VERSION 1u
/* Memory functions of the program. They must be thread-safe, and must not call functions of the library. */
typedef struct clothstream_allocator {
  uint32_t version CS_INIT(CLOTHSTREAM_ALLOCATOR_VERSION);
  void* context; /* argument of both functions */
  /* Returns memory of `bytes` (at least 1) at a multiple of `alignment`, a power of two; NULL without memory.
   */
  void* (*allocate)(void* context, size_t bytes, size_t alignment);
  /* Frees what allocate has returned; never NULL. */
  void (*release)(void* context, void* memory);
} clothstream_allocator;
/* Makes the library take its memory from these functions, instead of from malloc. It applies to all streams
 * of the process. Call it at most once, before all other functions of the library; later it fails. Memory of
 * OpenSSL, zstd, threads and exceptions still comes from the C library. A library built for gRPC, or with
 * sanitizers, refuses it. */
clothstream_result clothstream_set_allocator(const clothstream_allocator* allocator) CS_NOEXCEPT;

/* Monotonic clock of all times. */
uint64_t clothstream_now_us(void) CS_NOEXCEPT;
/* Returns why the last call in this thread did not return CLOTHSTREAM_OK: what was wrong, where, what to do.
 * Valid until the next call in this thread that returns a clothstream_result. "" before the first. */
const char* clothstream_error_text(void) CS_NOEXCEPT;
/* Version of the library: "major.minor.patch". */
const char* clothstream_version(void) CS_NOEXCEPT;

/* NOLINTEND(modernize-use-using) */

#ifdef __cplusplus
}
#endif
#endif
