/* SPDX-License-Identifier: MIT
 * Prints the version of the library. Returns 1 if a function fails. */
#include <clothstream/clothstream.h>
#include <stdio.h>
#include <string.h>

int main(void) {
  clothstream_stream* stream = NULL;
  if (clothstream_open("no address/", NULL, &stream) != CLOTHSTREAM_INVALID) return 1;
  if (strstr(clothstream_error_text(), "no address/") == NULL) return 1;
  printf("libclothstream %s\n", clothstream_version());
  return 0;
}
