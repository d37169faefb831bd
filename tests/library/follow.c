/* SPDX-License-Identifier: MIT
 * Test program in C: follows a stream through libclothstream. Usage: follow_c ADDRESS [lost|wants]
 * lost: waits for the end of the stream. wants: requests a coarser quality than the finest. Prints
 * "frame TICK HASH" for each decoded frame. Prints the failed check and returns 1 on an error. */
#define _POSIX_C_SOURCE 200809L
#include <clothstream/clothstream.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#define CHECK(holds)                                                                \
  do {                                                                              \
    if (!(holds)) {                                                                 \
      fprintf(stderr, "%s:%d: check failed: %s (%s)\n", __FILE__, __LINE__, #holds, \
              clothstream_error_text());                                            \
      return 1;                                                                     \
    }                                                                               \
  } while (0)

static const uint64_t kSecond = 1000000;

static uint64_t fnv1a(const void* data, size_t bytes) {
  const unsigned char* byte = data;
  uint64_t hash = 0xcbf29ce484222325u;
  for (size_t i = 0; i < bytes; ++i) hash = (hash ^ byte[i]) * 0x100000001b3u;
  return hash;
}

static int says_what_is_wrong(void) {
  char anything = 0;
  clothstream_stream* stream = (clothstream_stream*)&anything;
  clothstream_options options;
  clothstream_default_options(&options);
  options.join_timeout_ms = 3000;
  CHECK(clothstream_open("127.0.0.1:1", &options, &stream) == CLOTHSTREAM_UNREACHABLE);
  CHECK(stream == NULL);
  CHECK(strstr(clothstream_error_text(), "127.0.0.1:1") != NULL);
  CHECK(clothstream_open("ftp://here", NULL, &stream) == CLOTHSTREAM_INVALID);
  CHECK(strstr(clothstream_error_text(), "ftp://here") != NULL);
  CHECK(clothstream_open(NULL, NULL, &stream) == CLOTHSTREAM_INVALID);
  options.version = 99;
  CHECK(clothstream_open("127.0.0.1", &options, &stream) == CLOTHSTREAM_INVALID);
  CHECK(strstr(clothstream_error_text(), "99") != NULL);
  clothstream_close(NULL);
  return 0;
}

static int refuses_an_unknown_scene(const char* address) {
  clothstream_stream* stream = NULL;
  clothstream_options options;
  clothstream_default_options(&options);
  options.scene = "no such scene";
  CHECK(clothstream_open(address, &options, &stream) == CLOTHSTREAM_REFUSED);
  CHECK(strstr(clothstream_error_text(), "no such scene") != NULL);
  return 0;
}

static int is_described(cs_client* client) {
  uint32_t indices = 0;
  cs_cloth cloth = {.version = CS_CLOTH_VERSION};
  CHECK(cs_get_state(client) == CS_STATE_JOINED);
  CHECK(strcmp(cs_scene_name(client), "small") == 0);
  CHECK(cs_get_role(client) == CS_ROLE_PARTICIPANT);
  CHECK(cs_vertex_count(client) == 17 * 13 + 9 * 11);
  const uint32_t* triangles = cs_triangles(client, &indices);
  CHECK(indices == 3 * 2 * (16 * 12 + 8 * 10));
  for (uint32_t i = 0; i < indices; ++i) CHECK(triangles[i] < cs_vertex_count(client));
  CHECK(cs_cloth_count(client) == 2);
  CHECK(cs_get_cloth(client, 1, &cloth) == 1);
  CHECK(strcmp(cloth.name, "right") == 0);
  CHECK(cloth.rows == 9 && cloth.columns == 11 && cloth.first_vertex == 17 * 13);
  return 0;
}

static int has_unit_vectors(const float* normals, uint32_t count) {
  for (uint32_t i = 0; i < count; ++i, normals += 3) {
    const float squared = normals[0] * normals[0] + normals[1] * normals[1] + normals[2] * normals[2];
    CHECK(fabsf(squared - 1) < 1e-4f);
  }
  return 0;
}

typedef int get_collider(const cs_client* client, uint32_t index, cs_collider* out);

static int has_own_collider(const cs_client* client, const cs_own_collider* sphere, get_collider* get) {
  cs_collider collider = {.version = CS_COLLIDER_VERSION};
  for (uint32_t i = 0; get(client, i, &collider) != 0; ++i) {
    if (collider.participant_id != cs_participant_id(client)) continue;
    if (collider.shape != CS_SHAPE_SPHERE || fabsf(collider.radius - sphere->radius) > 1e-6f) continue;
    if (fabsf(collider.position[0] - sphere->position[0]) < 1e-4f &&
        fabsf(collider.position[1] - sphere->position[1]) < 1e-4f &&
        fabsf(collider.position[2] - sphere->position[2]) < 1e-4f)
      return 1;
  }
  return 0;
}

struct seen {
  unsigned frames, moved, in_time;
  uint64_t tick, hash, shown_us;
  int own_collider, played_collider, gravity, grab, others;
};

static int look(cs_client* client, const cs_own_collider* sphere, struct seen* seen) {
  const uint32_t count = cs_vertex_count(client);
  const float* positions = cs_positions(client);
  cs_statistics statistics = {.version = CS_STATISTICS_VERSION};
  cs_get_statistics(client, clothstream_now_us(), &statistics);
  if (statistics.frames == 0) return 0;
  if (statistics.tick != seen->tick) {
    const uint64_t hash = fnv1a(positions, 3 * sizeof(float) * count);
    for (uint32_t i = 0; i < 3 * count; ++i) CHECK(positions[i] > -5 && positions[i] < 5);
    CHECK(has_unit_vectors(cs_normals(client), count) == 0);
    printf("frame %llu %016llx\n", (unsigned long long)statistics.tick, (unsigned long long)hash);
    seen->moved += hash != seen->hash;
    seen->hash = hash;
    seen->tick = statistics.tick;
    ++seen->frames;
  }
  cs_played played = {.version = CS_PLAYED_VERSION};
  const uint64_t now_us = clothstream_now_us();
  CHECK(cs_play_out(client, now_us, now_us, &played) == 1);
  CHECK(played.server_time_us >= seen->shown_us);
  seen->shown_us = played.server_time_us;
  seen->in_time += played.shown == CS_SHOWN_FRAME || played.shown == CS_SHOWN_BETWEEN;
  positions = cs_played_positions(client);
  for (uint32_t i = 0; i < 3 * count; ++i) CHECK(positions[i] > -6 && positions[i] < 6);
  CHECK(has_unit_vectors(cs_played_normals(client), count) == 0);
  seen->own_collider |= has_own_collider(client, sphere, cs_get_collider);
  seen->played_collider |= has_own_collider(client, sphere, cs_get_played_collider);
  return 0;
}

static int follows(const char* address) {
  clothstream_stream* stream = NULL;
  clothstream_options options;
  clothstream_default_options(&options);
  options.scene = "small";
  options.display_name = "Ada";
  options.role = CS_ROLE_PARTICIPANT;
  CHECK(clothstream_open(address, &options, &stream) == CLOTHSTREAM_OK);

  const cs_own_collider sphere = {
      .version = CS_OWN_COLLIDER_VERSION, .position = {0.25f, 3.5f, -0.75f}, .radius = 0.0625f};
  const float gravity[3] = {0, -8, 0};
  cs_play_out_options play_out;
  cs_default_play_out(&play_out);
  cs_client* client = clothstream_acquire(stream);
  CHECK(is_described(client) == 0);
  CHECK(cs_set_play_out(client, &play_out) == 1);
  CHECK(cs_set_colliders(client, &sphere, 1, clothstream_now_us()) == 1);
  cs_set_environment(client, gravity, NULL, NULL);
  clothstream_release(stream);

  struct seen seen;
  memset(&seen, 0, sizeof seen);
  const uint64_t end_us = clothstream_now_us() + 60 * kSecond;
  while (seen.frames < 100 || !seen.own_collider || !seen.played_collider || !seen.gravity || !seen.grab ||
         !seen.others) {
    uint32_t events = 0;
    CHECK(clothstream_now_us() < end_us);
    CHECK(clothstream_wait(stream, 1000, &events) == CLOTHSTREAM_OK);
    client = clothstream_acquire(stream);
    CHECK(look(client, &sphere, &seen) == 0);
    if (seen.frames == 10) { /* grabs a hanging corner */
      cs_grab grab = {.version = CS_GRAB_VERSION, .id = 5};
      memcpy(grab.position, cs_positions(client) + 3 * (17 * 13 - 1), sizeof grab.position);
      grab.radius = grab.reach = grab.max_force = grab.slip_distance = NAN;
      CHECK(cs_set_grabs(client, &grab, 1, clothstream_now_us()) == 1);
    }
    if (events & CS_EVENT_GRABS) {
      cs_grab_event event = {.version = CS_GRAB_EVENT_VERSION};
      for (uint32_t i = 0; cs_get_grab_event(client, i, &event) != 0; ++i)
        seen.grab |= event.participant_id == cs_participant_id(client) && event.grab_id == 5 &&
                     event.kind == CS_GRAB_TAKEN && event.vertices > 0;
    }
    if (events & CS_EVENT_PARAMETERS) {
      cs_environment environment = {.version = CS_ENVIRONMENT_VERSION};
      CHECK(cs_get_environment(client, &environment) == 1);
      seen.gravity |= environment.gravity[1] == gravity[1];
    }
    cs_participant participant = {.version = CS_PARTICIPANT_VERSION};
    for (uint32_t i = 0; cs_get_participant(client, i, &participant) != 0; ++i)
      seen.others |= strcmp(participant.name, "watcher") == 0;
    clothstream_release(stream);
  }
  client = clothstream_acquire(stream);
  cs_statistics statistics = {.version = CS_STATISTICS_VERSION};
  cs_stage_statistics stages = {.version = CS_STAGE_STATISTICS_VERSION};
  CHECK(cs_get_statistics(client, clothstream_now_us(), &statistics) == 1);
  CHECK(cs_get_stage_statistics(client, &stages) == 1);
  clothstream_release(stream);
  CHECK(seen.moved > 50);
  CHECK(seen.in_time > 0);
  CHECK(statistics.hash_mismatches == 0 && statistics.decode_errors == 0);
  CHECK(stages.delay_ms > 0 && stages.displayable_ms > 0);
  printf("stages: server %.2f ms, network %.2f ms, decode %.3f ms, displayable %.2f ms, delay %.2f ms\n",
         stages.server_ms, stages.network_ms, stages.decode_ms, stages.displayable_ms, stages.delay_ms);
  clothstream_close(stream);
  return 0;
}

static int is_told_of_the_end(const char* address) {
  clothstream_stream* stream = NULL;
  clothstream_options options;
  clothstream_default_options(&options);
  options.reconnect_for_ms = 0;
  CHECK(clothstream_open(address, &options, &stream) == CLOTHSTREAM_OK);
  printf("joined\n");
  fflush(stdout);
  uint32_t events = 0;
  clothstream_result result = CLOTHSTREAM_OK;
  const uint64_t end_us = clothstream_now_us() + 60 * kSecond;
  while (result == CLOTHSTREAM_OK && clothstream_now_us() < end_us)
    result = clothstream_wait(stream, 1000, &events);
  CHECK(result == CLOTHSTREAM_LOST);
  CHECK(strstr(clothstream_error_text(), address) != NULL);
  cs_client* client = clothstream_acquire(stream);
  CHECK(cs_vertex_count(client) > 0 && cs_positions(client) != NULL);
  clothstream_release(stream);
  clothstream_close(stream);
  return 0;
}

static int has_what_it_wants(const char* address) {
  clothstream_stream* stream = NULL;
  clothstream_options options;
  clothstream_default_options(&options);
  options.quality = 4;
  CHECK(clothstream_open(address, &options, &stream) == CLOTHSTREAM_INVALID);
  options.quality = 1;
  options.transport = CLOTHSTREAM_TRANSPORT_TCP + 1;
  CHECK(clothstream_open(address, &options, &stream) == CLOTHSTREAM_INVALID);
  options.transport = CLOTHSTREAM_TRANSPORT_TCP;
  CHECK(clothstream_open(address, &options, &stream) == CLOTHSTREAM_OK);
  cs_datagram_statistics datagrams = {.version = CS_DATAGRAM_STATISTICS_VERSION};
  CHECK(clothstream_get_datagram_statistics(stream, &datagrams) == 0);
  uint64_t tick = 0;
  const uint64_t end_us = clothstream_now_us() + 60 * kSecond;
  for (unsigned frames = 0; frames < 20;) {
    uint32_t events = 0, quality = 0;
    CHECK(clothstream_now_us() < end_us);
    CHECK(clothstream_wait(stream, 1000, &events) == CLOTHSTREAM_OK);
    cs_client* client = clothstream_acquire(stream);
    cs_statistics statistics = {.version = CS_STATISTICS_VERSION};
    cs_get_statistics(client, clothstream_now_us(), &statistics);
    CHECK(cs_get_quality(client, &quality) == 1);
    clothstream_release(stream);
    if (statistics.frames == 0 || statistics.tick == tick) continue;
    CHECK(quality >= 1);
    tick = statistics.tick;
    ++frames;
  }
  clothstream_close(stream);
  return 0;
}

int main(int argc, char** argv) {
  if (argc < 2) return 2;
  if (argc > 2)
    return strcmp(argv[2], "lost") == 0 ? is_told_of_the_end(argv[1]) : has_what_it_wants(argv[1]);
  return says_what_is_wrong() || refuses_an_unknown_scene(argv[1]) || follows(argv[1]);
}
