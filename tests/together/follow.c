/* SPDX-License-Identifier: MIT
 * Follows a stream through libclothstream on any platform, for together.test.mjs. Usage:
 * follow ADDRESS FINGERPRINT TOKEN_FILE NAME OUT. Prints "frame TICK HASH" for each frame, with the 64-bit
 * FNV-1a hash of the positions. After the notice that the scene is paused, waits for the frame of that tick,
 * writes its positions to OUT, and leaves. */
#include <clothstream/clothstream.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

static uint64_t fnv1a(const float* values, size_t count) {
  uint64_t hash = 0xcbf29ce484222325u;
  const unsigned char* bytes = (const unsigned char*)values;
  for (size_t i = 0; i < count * sizeof *values; ++i) hash = (hash ^ bytes[i]) * 0x100000001b3u;
  return hash;
}

static int fail(const char* what) {
  fprintf(stderr, "%s: %s\n", what, clothstream_error_text());
  return 1;
}

/* Returns whether the positions were written. */
static int save(const char* path, const float* positions, size_t count) {
  FILE* const file = fopen(path, "wb");
  if (file == NULL) return 0;
  const int complete = fwrite(positions, sizeof *positions, count, file) == count;
  return fclose(file) == 0 && complete;
}

int main(int argc, char** argv) {
  static char token[CLOTHSTREAM_TOKEN_BYTES];
  if (argc != 6) return 2;
  FILE* const secret = fopen(argv[3], "r");
  if (secret == NULL || fgets(token, sizeof token, secret) == NULL) return 2;
  fclose(secret);
  token[strcspn(token, "\r\n")] = '\0';
  clothstream_options options;
  clothstream_default_options(&options);
  options.fingerprint = argv[2];
  options.token = token;
  options.display_name = argv[4];
  options.join_timeout_ms = 60000;
  clothstream_stream* stream;
  if (clothstream_open(argv[1], &options, &stream) != CLOTHSTREAM_OK) return fail("clothstream_open");

  for (int paused = 0, idle = 0; !paused || idle < 4;) {
    uint32_t events = 0;
    if (clothstream_wait(stream, 500, &events) != CLOTHSTREAM_OK) return fail("clothstream_wait");
    cs_client* const client = clothstream_acquire(stream);
    const size_t count = (size_t)3 * cs_vertex_count(client);
    if ((events & CS_EVENT_FRAME) != 0) {
      cs_statistics statistics = {.version = CS_STATISTICS_VERSION};
      cs_get_statistics(client, clothstream_now_us(), &statistics);
      printf("frame %" PRIu64 " %016" PRIx64 "\n", statistics.tick, fnv1a(cs_positions(client), count));
      fflush(stdout);
    }
    paused = paused || ((events & CS_EVENT_NOTICE) != 0 && strstr(cs_notice_text(client), "paused") != NULL);
    idle = (events & CS_EVENT_FRAME) != 0 ? 0 : idle + 1;
    if (paused && !save(argv[5], cs_positions(client), count)) return 1;
    clothstream_release(stream);
  }
  clothstream_close(stream);
  return 0;
}
