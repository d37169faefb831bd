/* SPDX-License-Identifier: MIT
 * Test program in C for every platform: prints "frame TICK HASH" for the frames that it decodes, so that the
 * frames of two platforms can be compared. Usage: hashes ADDRESS FRAMES [ca|fingerprint|token TEXT]...
 *                                                 hashes recording FILE
 * FRAMES: number of frames, then it leaves. Prints why and returns 1 if it cannot join or a frame is wrong.
 */
#include <clothstream/clothstream.h>
#include <clothstream/recording.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const uint64_t kLongestUs = 120000000;

static uint64_t fnv1a(uint64_t hash, const void* data, size_t bytes) {
  const unsigned char* byte = data;
  for (size_t i = 0; i < bytes; ++i) hash = (hash ^ byte[i]) * 0x100000001b3u;
  return hash;
}

/* Hash of the bits of all positions and normals. */
static uint64_t hash_of(const cs_client* client) {
  const size_t bytes = 3 * sizeof(float) * cs_vertex_count(client);
  return fnv1a(fnv1a(0xcbf29ce484222325u, cs_positions(client), bytes), cs_normals(client), bytes);
}

static int fail(const char* what) {
  fprintf(stderr, "%s: %s\n", what, clothstream_error_text());
  return 1;
}

static int follow(clothstream_stream* stream, unsigned long frames) {
  const uint64_t end_us = clothstream_now_us() + kLongestUs;
  uint64_t tick = UINT64_MAX;
  while (frames > 0) {
    uint32_t events = 0;
    if (clothstream_wait(stream, 1000, &events) != CLOTHSTREAM_OK) return fail("the stream ended");
    if (clothstream_now_us() > end_us) return fail("too few frames in two minutes");
    cs_client* client = clothstream_acquire(stream);
    cs_statistics statistics = {.version = CS_STATISTICS_VERSION};
    cs_get_statistics(client, clothstream_now_us(), &statistics);
    if (statistics.frames > 0 && statistics.tick != tick) {
      tick = statistics.tick;
      printf("frame %" PRIu64 " %016" PRIx64 "\n", tick, hash_of(client));
      fflush(stdout);
      --frames;
    }
    clothstream_release(stream);
    if (statistics.hash_mismatches + statistics.decode_errors > 0) return fail("a frame was decoded wrongly");
  }
  return 0;
}

static int read_recording(const char* path) {
  cs_recording* recording = cs_recording_open(path, 0);
  cs_recorded message = {.version = CS_RECORDED_VERSION};
  cs_recording_result result;
  int wrong = 0;
  while ((result = cs_recording_next(recording, CS_RECORDED_FRAME, &message)) == CS_RECORDING_NEXT) {
    const cs_client* client = cs_recording_client(recording);
    wrong |= cs_reconstruction_hash(client) != message.reconstruction_hash;
    printf("frame %" PRIu64 " %016" PRIx64 "\n", message.tick, hash_of(client));
  }
  if (result == CS_RECORDING_ERROR) fprintf(stderr, "%s: %s\n", path, cs_recording_error_text(recording));
  if (wrong) fprintf(stderr, "%s: a frame was decoded wrongly\n", path);
  cs_recording_close(recording);
  return result == CS_RECORDING_ERROR || wrong;
}

int main(int argc, char** argv) {
  if (argc == 3 && strcmp(argv[1], "recording") == 0) return read_recording(argv[2]);
  if (argc < 3 || argc % 2 == 0) return 2;
  clothstream_options options;
  clothstream_default_options(&options);
  for (int i = 3; i < argc; i += 2) {
    if (strcmp(argv[i], "ca") == 0) options.ca_file = argv[i + 1];
    if (strcmp(argv[i], "fingerprint") == 0) options.fingerprint = argv[i + 1];
    if (strcmp(argv[i], "token") == 0) options.token = argv[i + 1];
  }
  clothstream_stream* stream = NULL;
  if (clothstream_open(argv[1], &options, &stream) != CLOTHSTREAM_OK) return fail(argv[1]);
  const int result = follow(stream, strtoul(argv[2], NULL, 10));
  clothstream_close(stream);
  return result;
}
