// SPDX-License-Identifier: MIT
#include "server/telemetry/thread_name.h"

#include <cassert>
#include <cstring>

#include <pthread.h>

namespace clothstream::telemetry {

void nameThread(const char* name) {
  assert(std::strlen(name) <= 15);  // what Linux keeps
  pthread_setname_np(pthread_self(), name);
}

}  // namespace clothstream::telemetry
