// SPDX-License-Identifier: MIT
// Push constants of the kernel move_words.
#ifndef CLOTHSTREAM_SHADERS_SHARED_MOVE_WORDS_H
#define CLOTHSTREAM_SHADERS_SHARED_MOVE_WORDS_H

#include "shaders/shared/types.h"

CLOTHSTREAM_SHARED_BEGIN

struct MovePush {
  uint32_t from;  // first word that is copied
  uint32_t to;    // first word that is written
  uint32_t words;
  uint32_t fills;  // not 0: each word becomes `value`
  uint32_t value;
};

CLOTHSTREAM_SHARED_END

#endif
