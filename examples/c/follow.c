/* SPDX-License-Identifier: MIT
 * Joins a scene, puts a ball into the cloth, and prints where the cloth is. Usage: follow [ADDRESS] */
#include <clothstream/clothstream.h>
#include <stdio.h>

int main(int argc, char** argv) {
  clothstream_stream* stream;
  if (clothstream_open(argc > 1 ? argv[1] : "127.0.0.1", NULL, &stream) != CLOTHSTREAM_OK) {
    fprintf(stderr, "%s\n", clothstream_error_text());
    return 1;
  }
  cs_play_out_options smooth;
  cs_default_play_out(&smooth);
  const cs_own_collider ball = {.version = CS_OWN_COLLIDER_VERSION,
                                .shape = CS_SHAPE_SPHERE,
                                .position = {0, 1.5f, 0.3f},
                                .radius = 0.1f};
  cs_client* client = clothstream_acquire(stream);
  cs_set_play_out(client, &smooth);
  cs_set_colliders(client, &ball, 1, clothstream_now_us());
  clothstream_release(stream);

  uint32_t events = 0;
  for (int i = 0; i < 100 && clothstream_wait(stream, 100, &events) == CLOTHSTREAM_OK; ++i) {
    client = clothstream_acquire(stream);
    uint64_t now_us = clothstream_now_us(); /* or when this will be displayed */
    cs_play_out(client, now_us, now_us, NULL);
    const float* p = cs_played_positions(client); /* and cs_played_normals, cs_triangles: draw them */
    printf("%u vertices, the first at %.2f %.2f %.2f\n", cs_vertex_count(client), p[0], p[1], p[2]);
    clothstream_release(stream);
  }
  clothstream_close(stream);
  return 0;
}
