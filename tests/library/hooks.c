// SPDX-License-Identifier: MIT
// Gives the library memory functions and a log. Usage: hooks ADDRESS. Prints the log until the first frame,
// and what happened to the memory.
#include <clothstream/clothstream.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static atomic_llong allocations, live, misaligned;
static int context;

static void* allocate(void* given, size_t bytes, size_t alignment) {
  if (given != &context) abort();
  const size_t step = alignment < sizeof(void*) ? sizeof(void*) : alignment;
  void* const memory = aligned_alloc(step, (bytes + step - 1) / step * step);
  if (memory == NULL) return NULL;
  if (((size_t)memory) % alignment != 0) misaligned++;
  allocations++;
  live++;
  return memory;
}

static void release(void* given, void* memory) {
  if (given != &context || memory == NULL) abort();
  live--;
  free(memory);
}

static void printLine(void* given, uint32_t level, const char* text) {
  printf("%s %u: %s\n", (const char*)given, level, text);
  fflush(stdout);
}

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  const clothstream_allocator nothing = {CLOTHSTREAM_ALLOCATOR_VERSION, NULL, NULL, NULL};
  if (getenv("REFUSE") != NULL) {
    const clothstream_result result = clothstream_set_allocator(&nothing);
    printf("%u %s\n", result, clothstream_error_text());
    return clothstream_set_allocator(NULL) == CLOTHSTREAM_INVALID ? 0 : 1;
  }
  const clothstream_allocator own = {CLOTHSTREAM_ALLOCATOR_VERSION, &context, &allocate, &release};
  if (clothstream_set_allocator(&own) != CLOTHSTREAM_OK) {
    printf("no allocator: %s\n", clothstream_error_text());
    return 1;
  }
  static char prefix[] = "log";
  clothstream_options options;
  clothstream_default_options(&options);
  options.log = &printLine;
  options.log_context = prefix;
  clothstream_stream* stream;
  if (clothstream_open(argv[1], &options, &stream) != CLOTHSTREAM_OK) {
    printf("%s\n", clothstream_error_text());
    return 1;
  }
  uint32_t events = 0, all = 0;
  while ((all & CS_EVENT_FRAME) == 0 && clothstream_wait(stream, 60000, &events) == CLOTHSTREAM_OK)
    all |= events;
  if (getenv("WAIT") != NULL)
    while (clothstream_wait(stream, 60000, &events) == CLOTHSTREAM_OK) continue;
  clothstream_close(stream);
  printf("allocated %s, live %lld, misaligned %lld\n", allocations > 100 ? "much" : "little", (long long)live,
         (long long)misaligned);
  printf("second call: %u\n", clothstream_set_allocator(&own));
  return 0;
}
