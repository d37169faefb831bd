/* SPDX-License-Identifier: MIT
 * The client without input or output: bytes in, bytes out. A C interface, so that it is the same natively and
 * as WebAssembly.
 *
 * A transport feeds every serialised ServerMessage to cs_receive and writes every message that
 * cs_next_outgoing gives as one ClientMessage. It says when it opens a connection and when it has lost one,
 * and opens another when cs_connect_at says so: whoever is cut off comes back as the same participant, with
 * the colliders and grabs that it had. All times are microseconds of one steady clock of the
 * caller's. Not thread-safe: one thread a client at a time. No function throws or aborts on bytes from
 * outside, and what it holds is bounded: at most 256 MiB of content on its way, and geometry in proportion to
 * the description that arrived. Where memory runs out all the same, the native library ends the program and
 * WebAssembly traps. Pointers that are returned stay valid until the next call of cs_receive on the same
 * client, unless said otherwise; strings are UTF-8, never NULL.
 */
#ifndef CLOTHSTREAM_CLIENTS_CORE_CORE_H
#define CLOTHSTREAM_CLIENTS_CORE_CORE_H

#include <stddef.h>
#include <stdint.h>

/* No exception leaves a function, whatever language its caller is in. */
#ifdef __cplusplus
#define CS_NOEXCEPT noexcept
extern "C" {
#else
#define CS_NOEXCEPT
#endif

#define CS_PROTOCOL_VERSION 1u
#define CS_MAX_COLLIDERS 40u
#define CS_MAX_GRABS 10u
#define CS_HAND_JOINTS 26u
#define CS_HAND_BONES 20u

/* NOLINTBEGIN(modernize-use-using): C has no using. */
typedef struct cs_client cs_client;

typedef enum cs_state {
  CS_STATE_JOINING = 0, /* Hello is out, or waits to be taken */
  CS_STATE_JOINED = 1,  /* description complete, frames follow */
  CS_STATE_FAILED = 2,  /* cs_error_text says why; nothing more will come */
  /* Cut off: what was there before is still there to be read. Poses and grabs are kept, and sent upon return;
   * what else is asked for meanwhile is dropped. */
  CS_STATE_RECONNECTING = 3
} cs_state;

/* What cs_receive changed; a set of bits. */
enum {
  CS_EVENT_FRAME = 1,          /* new positions */
  CS_EVENT_DESCRIPTION = 2,    /* cloths, sizes, triangles changed */
  CS_EVENT_NOTICE = 4,         /* cs_notice_text */
  CS_EVENT_ERROR = 8,          /* cs_error_text; fatal if the state is CS_STATE_FAILED */
  CS_EVENT_PARAMETERS = 16,    /* somebody changed a parameter */
  CS_EVENT_SCENES = 32,        /* answer to cs_list_scenes */
  CS_EVENT_REPORT = 64,        /* cs_get_cloth_report */
  CS_EVENT_GRABS = 128,        /* cs_grab_event_count */
  CS_EVENT_CONTACTS = 256,     /* cs_contact_event_count */
  CS_EVENT_PARTICIPANTS = 512, /* cs_participant_count */
  CS_EVENT_PRESENCE = 1024,    /* cs_get_presence: why they changed */
  CS_EVENT_RETURNED = 2048,    /* joined again after it was cut off; cs_resumed says as whom */
  CS_EVENT_PLAYBACK = 4096     /* cs_get_playback */
};

typedef struct cs_statistics {
  uint64_t tick;            /* of the newest decoded frame */
  uint64_t frames;          /* decoded */
  uint64_t key_frames;      /* of these */
  uint64_t dropped;         /* frames of the stream that never came, by the gaps in their ticks; of those
                             * temporal layers that the server sends */
  uint64_t decode_errors;   /* packets that were refused */
  uint64_t bytes;           /* of packets received */
  uint64_t hash_mismatches; /* decoded frames whose hash is not the server's */
  double frames_per_second; /* over the last second */
  double kbit_per_second;   /* over the last second */
  double bits_per_vertex;   /* packet bits a vertex a frame, over all frames */
  double round_trip_ms;     /* smallest of the last pings */
  double clock_offset_us;   /* server clock - own clock, at now_us; 0 before the first pong */
  double decode_ms;         /* of the newest frame; 0 where there is no clock (see cs_set_clock) */
} cs_statistics;

/* As they stand now, everybody's changes included. */
typedef struct cs_environment {
  float gravity[3];    /* m/s^2 */
  float wind[3];       /* m/s */
  float air_density;   /* kg/m^3 */
  float gust_strength; /* m/s that each component of the wind strays by at most; 0: none */
  float gust_seconds;  /* from turn to turn */
} cs_environment;

typedef struct cs_cloth_parameters {
  float structural[2], shear[2], bend[2]; /* {stiffness in N/m, damping in N s/m} */
  float damping;                          /* 1/s */
} cs_cloth_parameters;

/* Solver.kind of scene.proto. */
typedef enum cs_solver {
  CS_SOLVER_AS_IS = 0,
  CS_SOLVER_MASS_SPRING = 1,
  CS_SOLVER_CONSTRAINT = 2,
  CS_SOLVER_ACAD = 3,
  CS_SOLVER_XPBD = 4,
  CS_SOLVER_IMPLICIT_EULER = 5
} cs_solver;

/* What can change of a cloth while it runs. In a change, NaN (of a solver 0, of bend_constraints -1, of
 * iterations 0) leaves a thing as it is; of what the server has not told, these are said too. What follows
 * `solver` is of solvers that solve a system: iterations and tolerance of all, the rest of those with
 * constraints. */
#define CS_CLOTH_SETTINGS_VERSION 1u
typedef struct cs_cloth_settings {
  uint32_t version;                       /* CS_CLOTH_SETTINGS_VERSION; later ones add fields at the end */
  float structural[2], shear[2], bend[2]; /* {stiffness in N/m, damping in N s/m} */
  float damping;                          /* 1/s */
  float drag, lift, friction;
  float thickness;          /* m */
  uint32_t solver;          /* cs_solver, or one that this client does not know yet */
  int32_t bend_constraints; /* 0 or 1 */
  uint32_t iterations;
  float tolerance;
  float compliance;       /* m/N; NaN: the server's default */
  float activation;       /* of CS_SOLVER_ACAD */
  int32_t assembled;      /* of CS_SOLVER_CONSTRAINT, whether it multiplies matrices: 0 or 1 */
  float dihedral_bending; /* N m */
  /* Of self-collision, m and dimensionless, and of tethers, a part of a length; only cloths that have these
   * from their start let them be changed, and of others they are NaN. */
  float ball_radius, ball_friction, tether_slack;
} cs_cloth_settings;

/* How the simulation of a cloth does, as the server says now and then (ClothReport in session.proto). */
#define CS_CLOTH_REPORT_VERSION 1u
typedef struct cs_cloth_report {
  uint32_t version;                          /* CS_CLOTH_REPORT_VERSION; later ones add fields at the end */
  uint32_t active_constraints, iterations;   /* of the last solve; 0 where springs are forces */
  float residual;                            /* of that solve, relative to where it started */
  float strain_max, strain_p99, strain_mean; /* parts of a length */
  float kinetic_energy, elastic_energy, gravity_energy; /* J */
  float penetration;                                    /* m into a collider */
  float device_ms; /* the whole tick of the scene on the server's device */
  uint64_t tick;   /* of which all this is */
} cs_cloth_report;

typedef struct cs_cloth {
  const char* name;
  uint32_t first_vertex, vertex_count;
  uint32_t rows, columns;            /* 0 if not a grid */
  uint32_t first_index, index_count; /* into cs_triangles */
} cs_cloth;

typedef struct cs_submesh {
  const char* name;                  /* may be "" */
  uint32_t first_index, index_count; /* into cs_triangles */
} cs_submesh;

/* Solid, in the collider's own frame; metres. */
typedef enum cs_shape {
  CS_SHAPE_SPHERE = 0,  /* radius */
  CS_SHAPE_CAPSULE = 1, /* radius, length of its segment along Y, which is centred on the origin */
  CS_SHAPE_PLANE = 2,   /* everything with y <= 0 */
  CS_SHAPE_BOX = 3,     /* size, centred on the origin */
  CS_SHAPE_HULL = 4     /* see cs_get_hull */
} cs_shape;

typedef struct cs_collider {
  const char* name;
  uint32_t shape; /* cs_shape */
  float position[3];
  float orientation[4]; /* x y z w */
  float radius, length, size[3];
  uint64_t participant_id; /* 0: the scene's */
} cs_collider;

/* One of this participant's own: sphere, capsule or box. */
typedef struct cs_own_collider {
  uint32_t shape; /* cs_shape */
  float position[3];
  float orientation[4]; /* x y z w; all zero: not turned */
  float radius, length, size[3];
} cs_own_collider;

/* A grab on cloth, as Grab in session.proto says. NaN: the server's default. */
typedef struct cs_grab {
  uint32_t id; /* one that was not in use begins to hold; one that is missing lets go */
  float position[3];
  float orientation[4]; /* x y z w; all zero: not turned */
  float radius, reach;  /* m */
  float max_force;      /* N */
  float slip_distance;  /* m */
} cs_grab;

/* HandSide of session.proto. */
typedef enum cs_hand_side { CS_HAND_LEFT = 1, CS_HAND_RIGHT = 2 } cs_hand_side;

/* GrabEventKind of session.proto. */
typedef enum cs_grab_event_kind {
  CS_GRAB_TAKEN = 1,   /* a grab began */
  CS_GRAB_SLIPPED = 2, /* it lost some of its vertices, or the last */
  CS_GRAB_RELEASED = 3 /* its participant let go, or left */
} cs_grab_event_kind;

typedef struct cs_grab_event {
  uint64_t participant_id;
  uint32_t grab_id;
  uint32_t kind;     /* cs_grab_event_kind, or one that this client does not know yet */
  uint32_t vertices; /* that the grab holds now */
} cs_grab_event;

/* ContactEventKind of session.proto. */
typedef enum cs_contact_event_kind { CS_CONTACT_BEGAN = 1, CS_CONTACT_ENDED = 2 } cs_contact_event_kind;

typedef struct cs_contact_event {
  uint32_t kind;           /* cs_contact_event_kind, or one that this client does not know yet */
  uint32_t collider_id;    /* of a participant's: its place in cs_set_shapes, or its bone */
  uint64_t participant_id; /* 0: the scene's */
  const char* collider;    /* of the scene's: its name */
  const char* cloth;
  float impulse; /* N s, in the tick in which the contact began; since then, where it ended */
  float seconds; /* that it took; 0 where it began */
} cs_contact_event;

/* Role of session.proto. */
typedef enum cs_role {
  CS_ROLE_UNSPECIFIED = 0, /* not known, or as the server likes */
  CS_ROLE_VIEWER = 1,
  CS_ROLE_PARTICIPANT = 2,
  CS_ROLE_OWNER = 3
} cs_role;

typedef struct cs_participant {
  uint64_t id;
  const char* name;        /* may be "" */
  const char* client_name; /* may be "" */
  uint32_t role;           /* cs_role, or one that this client does not know yet */
  int32_t away;            /* its connection is lost, and it is held for a while */
} cs_participant;

/* PresenceKind of session.proto. */
typedef enum cs_presence_kind {
  CS_PRESENCE_JOINED = 1,
  CS_PRESENCE_LEFT = 2,
  CS_PRESENCE_ROLE_CHANGED = 3,
  CS_PRESENCE_DISCONNECTED = 4,
  CS_PRESENCE_RETURNED = 5
} cs_presence_kind;

/* LeaveReason of session.proto. */
typedef enum cs_leave_reason {
  CS_LEAVE_LEFT = 1,
  CS_LEAVE_TIMED_OUT = 2,
  CS_LEAVE_REMOVED = 3
} cs_leave_reason;

typedef struct cs_presence {
  uint32_t kind;              /* cs_presence_kind, or one that this client does not know yet */
  uint32_t reason;            /* cs_leave_reason of who left, else 0 */
  uint64_t by;                /* the participant who did it; 0: it did so itself, or the server */
  cs_participant participant; /* as it is now; of who left, as it was */
} cs_presence;

/* Where a recording that is played stands. */
typedef struct cs_playback {
  double length;        /* s */
  double position;      /* s from its start, now */
  double speed;         /* seconds of it that pass in one */
  int32_t loop, paused; /* 0 or 1 */
} cs_playback;

/* How the newest motion is shown smoothly although frames come unevenly: each frame is displayed some time
 * after its tick began, and display times between two frames' show what lies between them. */
#define CS_PLAY_OUT_OPTIONS_VERSION 1u
typedef struct cs_play_out_options {
  uint32_t version; /* CS_PLAY_OUT_OPTIONS_VERSION; later ones add fields at the end */
  uint32_t frames;  /* the newest ones that are kept, 3 to 256: enough for the delay */
  /* From the beginning of a tick on the server to its display, 0 to 10000. NaN: as short as frames come in
   * time, which is the delay that 98 % of the last 256 of them would have kept, between the two bounds; it
   * changes by at most 5 % of the time that passes. */
  double delay_ms;
  double least_delay_ms, most_delay_ms; /* 0 to 10000 */
  /* Where the next frame is missing, the motion of the last two is led on for at most this long, 0 to 1000;
   * over as long again it comes back to the newest frame, and stands still. It is not led on from a key
   * frame, which may be a cut. */
  double lead_ms;
} cs_play_out_options;

typedef enum cs_shown {
  CS_SHOWN_NOTHING = 0, /* no frame yet: the rest positions */
  CS_SHOWN_FRAME = 1,   /* one at its own time: its very bits */
  CS_SHOWN_BETWEEN = 2, /* on the straight line from a frame to the next */
  CS_SHOWN_LED_ON = 3,  /* beyond the newest frame */
  CS_SHOWN_HELD = 4     /* a frame at another time: nothing is nearer */
} cs_shown;

#define CS_PLAYED_VERSION 1u
typedef struct cs_played {
  uint32_t version;        /* CS_PLAYED_VERSION; later ones add fields at the end */
  uint32_t shown;          /* cs_shown */
  uint64_t tick;           /* of the frame that it begins from */
  uint64_t server_time_us; /* display time less delay, on the server's clock; 0: not known yet */
  double fraction;         /* of the way to the next frame; led on: of the newest step, again */
} cs_played;

/* Where time goes on a frame's way, stage by stage. */
#define CS_STAGE_STATISTICS_VERSION 1u
typedef struct cs_stage_statistics {
  uint32_t version; /* CS_STAGE_STATISTICS_VERSION; later ones add fields at the end */
  /* Of play-out, 0 where it is off: frames that wait for their time; those that came after it; display time
   * in all that motion was led on beyond the newest frame, and that it stood still there; the delay now, and
   * the one that it is on its way to. */
  uint32_t frames_waiting;
  uint64_t late_frames;
  double led_on_ms, held_ms;
  double delay_ms, wanted_delay_ms;
  /* Of the newest decoded frame: from the tick's beginning to its whole packet, on the server; from there to
   * its arrival; decode_ms of cs_statistics; and all three. 0 before the first pong. */
  double server_ms, network_ms, decode_ms, displayable_ms;
} cs_stage_statistics;

/* scene may be "" for the server's default; strings are copied. */
cs_client* cs_create(const char* scene, const char* client_name) CS_NOEXCEPT;
/* The same with a name for other people, which may be "", and the cs_role that is wanted. */
cs_client* cs_create_as(const char* scene, const char* client_name, const char* display_name,
                        uint32_t role) CS_NOEXCEPT;
void cs_destroy(cs_client* client) CS_NOEXCEPT;
/* The most that it wants of the stream, before anything is sent: the finest quality (0 to 3, 0 is the finest
 * there is) and how many temporal layers (1 to 3; 0: all, whatever there are). */
void cs_want(cs_client* client, uint32_t quality, uint32_t temporal_layers) CS_NOEXCEPT;
/* For decode_ms: a steady clock in microseconds. Not exported by the WebAssembly module. */
void cs_set_clock(cs_client* client, uint64_t (*now_us)(void)) CS_NOEXCEPT;

/* One ServerMessage. Returns a set of CS_EVENT bits. */
uint32_t cs_receive(cs_client* client, const uint8_t* message, size_t bytes, uint64_t now_us) CS_NOEXCEPT;
/* Pings; call at least ten times a second. Longer pauses are not taken for silence of the server. */
void cs_update(cs_client* client, uint64_t now_us) CS_NOEXCEPT;
/* The next ClientMessage to send, or NULL; valid until the next call of this function. */
const uint8_t* cs_next_outgoing(cs_client* client, size_t* bytes) CS_NOEXCEPT;

/* The transport begins to open a connection; what went through the one before it, if any, is over. The first
 * outgoing message from here on is Hello. Need not be called for the first one. */
void cs_connecting(cs_client* client, uint64_t now_us) CS_NOEXCEPT;
/* The connection is lost, or could not be made. */
void cs_disconnected(cs_client* client, uint64_t now_us) CS_NOEXCEPT;
/* When the transport is to drop the connection that it has, if any, and open another: after a loss; where an
 * attempt leads nowhere; where a connection has brought nothing for a while. UINT64_MAX: not as things are.
 */
uint64_t cs_connect_at(const cs_client* client) CS_NOEXCEPT;
/* Whether the newest Welcome was to the participant that this client was before. */
int cs_resumed(const cs_client* client) CS_NOEXCEPT;

cs_state cs_get_state(const cs_client* client) CS_NOEXCEPT;
const char* cs_error_text(const cs_client* client) CS_NOEXCEPT;
/* The server's ErrorCode (session.proto) for the text above; 0 where the client itself found the error. */
uint32_t cs_error_code(const cs_client* client) CS_NOEXCEPT;
const char* cs_notice_text(const cs_client* client) CS_NOEXCEPT;
/* Who did what the notice tells; 0: the server, or somebody who is not in the scene. */
uint64_t cs_notice_participant(const cs_client* client) CS_NOEXCEPT;
void cs_get_statistics(const cs_client* client, uint64_t now_us, cs_statistics* out) CS_NOEXCEPT;
/* How much of the stream the server sends, by what this client wants and its link carries: a quality, and so
 * many temporal layers. 0 before the description. */
int cs_get_operating_point(const cs_client* client, uint32_t* quality, uint32_t* temporal_layers) CS_NOEXCEPT;
const char* cs_server_name(const cs_client* client) CS_NOEXCEPT;
const char* cs_device_name(const cs_client* client) CS_NOEXCEPT;
const char* cs_scene_name(const cs_client* client) CS_NOEXCEPT;
/* All who are in the scene, this participant too, in the order in which they joined. 0 if there is no such
 * one. */
uint32_t cs_participant_count(const cs_client* client) CS_NOEXCEPT;
int cs_get_participant(const cs_client* client, uint32_t index, cs_participant* out) CS_NOEXCEPT;
/* What the newest CS_EVENT_PRESENCE told. 0 before the first. */
int cs_get_presence(const cs_client* client, cs_presence* out) CS_NOEXCEPT;
/* This participant's cs_role, as the server gave it. A viewer's colliders, grabs and attachments stay here:
 * should it get another role, they are sent. */
uint32_t cs_get_role(const cs_client* client) CS_NOEXCEPT;
/* For owners. What becomes of it, everybody is told. */
void cs_set_role(cs_client* client, uint64_t participant_id, uint32_t role) CS_NOEXCEPT;
void cs_remove_participant(cs_client* client, uint64_t participant_id) CS_NOEXCEPT;
/* This participant's id, the scene's rates a second; 0 before they are known. */
uint64_t cs_participant_id(const cs_client* client) CS_NOEXCEPT;
uint32_t cs_stream_rate(const cs_client* client) CS_NOEXCEPT;
uint32_t cs_simulation_rate(const cs_client* client) CS_NOEXCEPT;
/* Seconds of the caller's clock between the first and the newest decoded frame. */
double cs_stream_seconds(const cs_client* client) CS_NOEXCEPT;

/* Geometry of the newest frame; 3 floats a vertex. Rest positions before the first frame. */
uint32_t cs_vertex_count(const cs_client* client) CS_NOEXCEPT;
const float* cs_positions(const cs_client* client) CS_NOEXCEPT;
const float* cs_normals(const cs_client* client) CS_NOEXCEPT;
uint64_t cs_reconstruction_hash(const cs_client* client) CS_NOEXCEPT;

/* Play-out; off at first, and with NULL again. While it is on, the newest frames are kept: 12 bytes a vertex
 * each, 24 where normals are sent, and as much as two more for what is shown; at most 256 MiB, which may make
 * them fewer, but not fewer than 3; beside these some 120 bytes for each collider and frame. 0 where a
 * version or a number is not allowed: then nothing changes. */
int cs_set_play_out(cs_client* client, const cs_play_out_options* options) CS_NOEXCEPT;
/* 32 frames; the delay adapts, 0 to 250 ms; motion is led on for 30 ms. */
void cs_default_play_out(cs_play_out_options* out) CS_NOEXCEPT;
/* What to show at display_time_us, which may be ahead of now_us. server_time_us does not go back for times
 * that grow from call to call, unless a clock steps. Until the delay is known, the newest frame is held.
 * `out->version` is to be set; out may be NULL. 0 where play-out is off. */
int cs_play_out(cs_client* client, uint64_t now_us, uint64_t display_time_us, cs_played* out) CS_NOEXCEPT;
/* As the newest cs_play_out chose, until the next one, or cs_receive; 3 floats a vertex. Normals are unit
 * vectors: those that were sent, turned alike, or computed from these positions; the first call does the
 * work. */
const float* cs_played_positions(const cs_client* client) CS_NOEXCEPT;
const float* cs_played_normals(const cs_client* client) CS_NOEXCEPT;
/* Likewise colliders, everybody's, at the time that is shown, as they touch the cloth there; cs_get_collider
 * has the newest frame's. There are those of the frame that it begins from; between two frames they move in a
 * straight line and turn the shorter way, but for those that jump: by more than 30 m/s or 120 degrees. The
 * scene's have the same index as there. Names are good until the next cs_play_out, or cs_receive. 0 if there
 * is no such one. */
uint32_t cs_played_collider_count(const cs_client* client) CS_NOEXCEPT;
int cs_get_played_collider(const cs_client* client, uint32_t index, cs_collider* out) CS_NOEXCEPT;
/* `out->version` is to be set; 0 where it is not known. */
int cs_get_stage_statistics(const cs_client* client, cs_stage_statistics* out) CS_NOEXCEPT;

/* Vertex indices, three a triangle, counter-clockwise seen from the front: of a grid from +Z of its own
 * frame; until the next CS_EVENT_DESCRIPTION. */
const uint32_t* cs_triangles(const cs_client* client, uint32_t* index_count) CS_NOEXCEPT;
uint32_t cs_cloth_count(const cs_client* client) CS_NOEXCEPT;
/* 0 if there is no such cloth or collider. */
int cs_get_cloth(const cs_client* client, uint32_t index, cs_cloth* out) CS_NOEXCEPT;
/* Texture coordinates of a mesh: `count` of {u, v}, v upwards; and for each of the cloth's index_count
 * triangle corners the number of the one it has. NULL and 0 where it has none. Until the next
 * CS_EVENT_DESCRIPTION, as submeshes' names. */
const float* cs_uvs(const cs_client* client, uint32_t cloth, uint32_t* count) CS_NOEXCEPT;
const uint32_t* cs_uv_indices(const cs_client* client, uint32_t cloth, uint32_t* count) CS_NOEXCEPT;
/* The parts of a mesh by material; 0 of a grid. */
uint32_t cs_submesh_count(const cs_client* client, uint32_t cloth) CS_NOEXCEPT;
int cs_get_submesh(const cs_client* client, uint32_t cloth, uint32_t index, cs_submesh* out) CS_NOEXCEPT;
uint32_t cs_collider_count(const cs_client* client) CS_NOEXCEPT;
int cs_get_collider(const cs_client* client, uint32_t index, cs_collider* out) CS_NOEXCEPT;
/* Corners (3 floats each) and triangles (counter-clockwise seen from outside) of a collider that is a hull,
 * in its own frame; NULL and 0 for others. Until the next CS_EVENT_DESCRIPTION. */
const float* cs_get_hull(const cs_client* client, uint32_t index, uint32_t* vertex_count,
                         const uint32_t** triangles, uint32_t* index_count) CS_NOEXCEPT;
/* 0 before the description, and where there is no such cloth. */
int cs_get_environment(const cs_client* client, cs_environment* out) CS_NOEXCEPT;
int cs_get_cloth_parameters(const cs_client* client, uint32_t index, cs_cloth_parameters* out) CS_NOEXCEPT;
/* `out->version` is to be set. 0 as above, where the version is not known, and where no report came yet. */
int cs_get_cloth_settings(const cs_client* client, uint32_t index, cs_cloth_settings* out) CS_NOEXCEPT;
int cs_get_cloth_report(const cs_client* client, uint32_t index, cs_cloth_report* out) CS_NOEXCEPT;
/* Names of the materials that cloths may be made of, as the server told with the description. What a cloth
 * was made of last; "" where that is none. */
uint32_t cs_material_count(const cs_client* client) CS_NOEXCEPT;
const char* cs_material(const cs_client* client, uint32_t index) CS_NOEXCEPT;
const char* cs_cloth_material(const cs_client* client, uint32_t cloth) CS_NOEXCEPT;
/* Who made the newest change that CS_EVENT_PARAMETERS told of; 0: the server. */
uint64_t cs_parameters_participant(const cs_client* client) CS_NOEXCEPT;

/* What became of everybody's grabs, as the newest CS_EVENT_GRABS told. 0 if there is no such event. */
uint32_t cs_grab_event_count(const cs_client* client) CS_NOEXCEPT;
int cs_get_grab_event(const cs_client* client, uint32_t index, cs_grab_event* out) CS_NOEXCEPT;

/* Whether this participant wants CS_EVENT_CONTACTS; not at first. */
void cs_want_contacts(cs_client* client, int wants, uint64_t now_us) CS_NOEXCEPT;
/* What began and ended, as the newest CS_EVENT_CONTACTS told. 0 if there is no such event. */
uint32_t cs_contact_event_count(const cs_client* client) CS_NOEXCEPT;
int cs_get_contact_event(const cs_client* client, uint32_t index, cs_contact_event* out) CS_NOEXCEPT;

/* What follows with a now_us is told with that time, by which the server places it among the ticks: it is
 * when the poses are true, which may be a little ahead, such as when a headset predicts them for. */
/* Sphere colliders of this participant: `count` of {x, y, z, radius}, at most CS_MAX_COLLIDERS, of which
 * the first 20 count beside two hands (the rest is left out); replaces all former ones; 0 takes them away.
 * Only the newest call counts if the transport is behind. */
void cs_set_colliders(cs_client* client, const float* spheres, uint32_t count, uint64_t now_us) CS_NOEXCEPT;
/* The same with other shapes and turned: the joints of a hand as capsules, say. */
void cs_set_shapes(cs_client* client, const cs_own_collider* colliders, uint32_t count,
                   uint64_t now_us) CS_NOEXCEPT;
/* A tracked hand: `count` joints of {x, y, z, radius} in metres, CS_HAND_JOINTS in the order of OpenXR's
 * XrHandJointEXT (palm first) or one less in that of WebXR's XRHand (which has no palm). The server makes
 * CS_HAND_BONES capsules of it, which count as colliders of this participant.
 * Replaces the former one of this side; 0 joints take it away. Returns 0, and changes nothing, for another
 * side or number of joints. */
int cs_set_hand(cs_client* client, uint32_t side, const float* joints, uint32_t count,
                uint64_t now_us) CS_NOEXCEPT;
/* This participant's grabs, at most CS_MAX_GRABS (the rest is left out); replaces all former ones. */
void cs_set_grabs(cs_client* client, const cs_grab* grabs, uint32_t count, uint64_t now_us) CS_NOEXCEPT;
/* Where an attachment of the scene is to go; orientation4 NULL: not turned. It stays there. */
void cs_move_attachment(cs_client* client, const char* attachment, const float* position3,
                        const float* orientation4, uint64_t now_us) CS_NOEXCEPT;
/* Parameters; NULL leaves one as it is. An empty cloth name means every cloth. */
void cs_set_environment(cs_client* client, const float* gravity3, const float* wind3,
                        const float* air_density) CS_NOEXCEPT;
void cs_set_gust(cs_client* client, float strength, float seconds) CS_NOEXCEPT;
void cs_set_cloth(cs_client* client, const char* cloth, const float* structural2, const float* shear2,
                  const float* bend2, const float* damping) CS_NOEXCEPT; /* springs: {stiffness, damping} */
/* Settings that change nothing, to begin a change from. */
void cs_keep_cloth_settings(cs_cloth_settings* out) CS_NOEXCEPT;
/* Another kind of solver comes with the settings that it last had as far as this client was told, else with
 * the defaults of scene.proto. Before the description nothing can be changed: 0, as for a version that is not
 * known and for a cloth that is not there. */
int cs_change_cloth(cs_client* client, const char* cloth, const cs_cloth_settings* settings) CS_NOEXCEPT;
/* The cloth, or with "" every one, becomes one of this material: springs, damping, drag, lift, friction, mass
 * and solver. The server knows which there are: cs_material. */
void cs_set_material(cs_client* client, const char* cloth, const char* material) CS_NOEXCEPT;
void cs_set_collider(cs_client* client, const char* collider, const float* position3,
                     const float* radius) CS_NOEXCEPT;

/* A key frame soon: who writes the stream down begins from it later. What comes until then is decoded as
 * ever. */
void cs_request_key_frame(cs_client* client, uint64_t now_us) CS_NOEXCEPT;

/* 0 where the scene is none that is played, or where it stands is not known yet. */
int cs_get_playback(const cs_client* client, uint64_t now_us, cs_playback* out) CS_NOEXCEPT;
/* Stops the scene's clock, or lets it run again. What follows is of recordings: from where they go on (s from
 * the start, at most the length), how fast (0.1 to 8), and whether they begin anew at their end. All of it is
 * for everybody in the scene, and not before it has been joined. */
void cs_pause(cs_client* client, int paused) CS_NOEXCEPT;
void cs_seek(cs_client* client, double seconds) CS_NOEXCEPT;
void cs_set_speed(cs_client* client, double speed) CS_NOEXCEPT;
void cs_set_loop(cs_client* client, int loop) CS_NOEXCEPT;

/* Asks for the scenes; after CS_EVENT_SCENES cs_scene gives them. */
void cs_list_scenes(cs_client* client) CS_NOEXCEPT;
uint32_t cs_scene_count(const cs_client* client) CS_NOEXCEPT;
const char* cs_scene(const cs_client* client, uint32_t index) CS_NOEXCEPT;

/* NOLINTEND(modernize-use-using) */

#ifdef __cplusplus
}
#endif
#endif
