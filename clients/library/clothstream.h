/* SPDX-License-Identifier: MIT
 * The native client library: the client of core.h with a connection of its own. A C interface.
 *
 * clothstream_open joins a scene; from then on a thread of the library moves bytes, decodes frames, keeps the
 * clock, and comes back where the connection is lost. Between clothstream_acquire and clothstream_release
 * that thread rests, and the cs_client is the caller's: every function of core.h may be called, and what they
 * point to stays as it is, so that positions, normals and triangles are read without a copy. Of core.h only
 * those are not for it that open and move a connection themselves: cs_create, cs_create_as, cs_want,
 * cs_destroy, cs_set_clock, cs_receive, cs_update, cs_next_outgoing, cs_connecting, cs_disconnected (they
 * serve who has a connection of another kind).
 *
 * Threads: all functions may be called from any thread; on one stream, clothstream_close is the last call,
 * and clothstream_release comes from the thread that acquired. Acquire for as long as it takes to copy or
 * draw: no message is taken meanwhile, and a stream that rests for seconds loses its connection. Whoever has
 * acquired a stream must not call clothstream_acquire, clothstream_wait or clothstream_close with it. Not to
 * be used in a child after fork() without exec().
 *
 * Times are microseconds of clothstream_now_us. Strings are UTF-8. No exception leaves the library; where
 * memory runs out while a stream runs, the program ends.
 */
#ifndef CLOTHSTREAM_CLIENTS_LIBRARY_CLOTHSTREAM_H
#define CLOTHSTREAM_CLIENTS_LIBRARY_CLOTHSTREAM_H

#include "clients/core/core.h"

#ifdef __cplusplus
extern "C" {
#endif

/* NOLINTBEGIN(modernize-use-using): C has no using. */
typedef struct clothstream_stream clothstream_stream;

typedef enum clothstream_result {
  CLOTHSTREAM_OK = 0,
  CLOTHSTREAM_INVALID = 1,     /* an argument is not allowed */
  CLOTHSTREAM_UNREACHABLE = 2, /* nobody answers at the address, or not in time */
  CLOTHSTREAM_REFUSED = 3,     /* the server said no: unknown scene, version, full, removed */
  CLOTHSTREAM_LOST = 4,        /* the stream has ended, and could not be had back */
  CLOTHSTREAM_FAILED = 5       /* no memory, no thread */
} clothstream_result;

#define CLOTHSTREAM_OPTIONS_VERSION 1u
typedef struct clothstream_options {
  uint32_t version; /* CLOTHSTREAM_OPTIONS_VERSION; later ones add fields at the end */
  uint32_t role;    /* cs_role that is wanted */
  /* The most that is wanted of the stream, as cs_want has it: the finest quality, 0 to 3; temporal layers, 1
   * to 3, or 0: all. What is sent, cs_get_operating_point says. */
  uint32_t quality, temporal_layers;
  const char* scene;        /* "": the server's default */
  const char* client_name;  /* of the program */
  const char* display_name; /* for other people; may be "" */
  uint32_t join_timeout_ms; /* at least 1 */
  /* For how long who is cut off tries to come back; 0: the stream ends with its connection. */
  uint32_t reconnect_for_ms;
} clothstream_options;

/* client_name is "libclothstream", the other strings are empty; no role is asked for; all of the stream; 10 s
 * to join, 60 s to come back. */
void clothstream_default_options(clothstream_options* out) CS_NOEXCEPT;

/* Joins; returns when the scene's description is there. `address`: HOST or HOST:PORT, port 50051 by default.
 * options NULL: the default ones; strings are copied. *out is the stream, NULL unless CLOTHSTREAM_OK. */
clothstream_result clothstream_open(const char* address, const clothstream_options* options,
                                    clothstream_stream** out) CS_NOEXCEPT;
/* Leaves the scene, which takes half a second at most; NULL is left alone. */
void clothstream_close(clothstream_stream* stream) CS_NOEXCEPT;

/* Until something has changed since the last call (the opening's changes are told by the first), the stream
 * has ended, or timeout_ms are over. *events: the CS_EVENT bits of all that changed. CLOTHSTREAM_OK while the
 * stream goes on, else why it ended; what came until then can still be read. */
clothstream_result clothstream_wait(clothstream_stream* stream, uint32_t timeout_ms,
                                    uint32_t* events) CS_NOEXCEPT;

/* See above. What was set while it was acquired is sent upon release. */
cs_client* clothstream_acquire(clothstream_stream* stream) CS_NOEXCEPT;
void clothstream_release(clothstream_stream* stream) CS_NOEXCEPT;

/* The clock that all times are of; it never steps. */
uint64_t clothstream_now_us(void) CS_NOEXCEPT;
/* Why the newest call in this thread did not give CLOTHSTREAM_OK: what was wrong, where, what to do. Until
 * the next call that gives a clothstream_result; "" before the first. */
const char* clothstream_error_text(void) CS_NOEXCEPT;
/* Of the library, "major.minor.patch". */
const char* clothstream_version(void) CS_NOEXCEPT;

/* NOLINTEND(modernize-use-using) */

#ifdef __cplusplus
}
#endif
#endif
