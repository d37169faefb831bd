/* SPDX-License-Identifier: MIT
 * C interface that reads recordings (docs/recording.md) without a server: frames, events, participants, and
 * the journal of a server.
 *
 * A recording is played in a cs_client of its own, which cs_recording_client returns. cs_recording_next reads
 * the next message of the file and gives it to this client. Then the functions of core.h that take a const
 * cs_client answer for this place in the recording: cs_positions, cs_normals, cs_reconstruction_hash,
 * cs_get_collider, cs_get_environment, cs_get_grab_event, cs_get_participant, and so on.
 *
 * Threads: a recording is not thread-safe. Call its functions from one thread at a time. Several recordings
 * are independent of each other.
 *
 * Errors: no function throws or aborts because of the bytes that it reads. A file that is cut is read up to
 * the cut. Memory and time are bounded before a chunk is decompressed: a chunk of the file has at most
 * 128 MiB, its index at most 256 MiB, all chunks together expand to at most 1024 times the file plus 512 MiB,
 * and the client has the default cs_limits. A larger max_vertices raises these limits. If memory runs out,
 * the native library ends the program and WebAssembly traps.
 *
 * Pointers and strings that a function returns belong to the recording. They stay valid until the next
 * cs_recording_next, cs_recording_seek or cs_recording_seek_tick, unless the function says otherwise. Strings
 * are UTF-8 and never NULL. A pointer argument must not be NULL unless the function says that it may be.
 *
 * Structs with a `version`, units and coordinates: as in core.h.
 */
#ifndef CLOTHSTREAM_CLIENTS_RECORDING_RECORDING_H
#define CLOTHSTREAM_CLIENTS_RECORDING_RECORDING_H

#include <clothstream/core.h>

#ifdef __cplusplus
extern "C" {
#endif

/* NOLINTBEGIN(modernize-use-using): C has no using. */

/* ---------------------------------------------------------------------------------------------------------------
 * Opening: from a file, from memory, or through a function that reads.
 *
 * The functions always return a recording; free it with cs_recording_close. cs_recording_is_open says whether
 * it can be read, else cs_recording_error_text says why not.
 *
 * max_vertices: most vertices of all cloths, 1 to 67108864, and half of the most triangles. A recording with
 * more is refused before its geometry is allocated. 0 means the default, 1048576. A chunk of the file has at
 * most 32 MiB and 96 bytes per vertex.
 */

typedef struct cs_recording cs_recording;

/* Opens a regular file. path: UTF-8. A file that grows is read up to the size that it has now. The
 * WebAssembly module does not export this function. */
cs_recording* cs_recording_open(const char* path, uint32_t max_vertices) CS_NOEXCEPT;
/* Opens the bytes of a file in memory. They are not copied: keep them unchanged until cs_recording_close. */
cs_recording* cs_recording_open_bytes(const uint8_t* bytes, size_t count, uint32_t max_vertices) CS_NOEXCEPT;

#define CS_RECORDING_SOURCE_VERSION 1u
/* Bytes that a function of the program reads, for example from an archive or over a network. */
typedef struct cs_recording_source {
  uint32_t version CS_INIT(CS_RECORDING_SOURCE_VERSION);
  uint32_t max_vertices;
  uint64_t size; /* bytes */
  void* user;    /* first argument of `read`; may be NULL */
  /* Copies `count` bytes from `offset` on, which lie within the size. Returns 1, or 0 if they cannot be read.
   * It is called only while a function of the recording runs, on its thread. */
  int (*read)(void* user, uint64_t offset, uint8_t* bytes, size_t count);
} cs_recording_source;
/* Opens a source, which is copied. The WebAssembly module does not export this function. */
cs_recording* cs_recording_open_source(const cs_recording_source* source) CS_NOEXCEPT;

/* Frees the recording, its client, and all pointers that they returned. NULL is allowed. */
void cs_recording_close(cs_recording* recording) CS_NOEXCEPT;
/* Returns 1 if the recording can be read, else 0. All other functions are allowed in both cases; without an
 * open recording they fail, and return 0, "" or NULL. */
int cs_recording_is_open(const cs_recording* recording) CS_NOEXCEPT;
/* Returns the last error as a sentence; "" if there was none. */
const char* cs_recording_error_text(const cs_recording* recording) CS_NOEXCEPT;
/* Returns the client in which the recording is played; NULL if the recording is not open. It has the
 * description of the stream from the start: cs_vertex_count, cs_triangles, cs_get_cloth. The pointer is valid
 * until cs_recording_close. */
const cs_client* cs_recording_client(const cs_recording* recording) CS_NOEXCEPT;

#define CS_RECORDING_INFO_VERSION 1u
typedef struct cs_recording_info {
  uint32_t version CS_INIT(CS_RECORDING_INFO_VERSION);
  /* 1: the file has its index. 0: it is cut or damaged at its end, and is read up to there. */
  int32_t complete;
  double seconds;    /* time from the first message to the last */
  uint64_t start_ns; /* time of the first message: nanoseconds since 1970 */
  uint64_t bytes;    /* size of the file */
  uint64_t frames;   /* number of frames, from the index; 0 if the file is not complete */
  uint64_t ticks;    /* number of recorded ticks, from the index; 0 in recordings of clients */
} cs_recording_info;
/* Fails if the recording is not open or `out->version` is unknown. */
int cs_recording_get_info(const cs_recording* recording, cs_recording_info* out) CS_NOEXCEPT;
/* Value of an entry of the metadata, such as "server", "scene", "started" or "device" (docs/recording.md); ""
 * without one. Valid until cs_recording_close. */
const char* cs_recording_metadata(const cs_recording* recording, const char* name) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Reading: message by message, and from any time on.
 */

/* Kinds of messages. A set of them is their sum. */
enum {
  CS_RECORDED_FRAME = 1,        /* cs_positions and all other functions about frames */
  CS_RECORDED_PARAMETERS = 2,   /* cs_get_environment, cs_get_cloth_settings */
  CS_RECORDED_EVENTS = 4,       /* cs_get_grab_event, cs_get_contact_event; see cs_recorded.events */
  CS_RECORDED_NOTICE = 8,       /* cs_notice_text */
  CS_RECORDED_PARTICIPANT = 16, /* somebody joined or left: cs_get_presence, cs_get_participant */
  /* Only in recordings of servers: the journal. */
  CS_RECORDED_SCENE = 32, /* the definition: cs_recording_message has a RecordedScene (recording.proto) */
  CS_RECORDED_TICK = 64,  /* input and state hash of a tick: cs_recording_get_tick */
  CS_RECORDED_CHECKPOINT = 128, /* exact state: cs_recording_state */
  CS_RECORDED_ALL = 255
};

#define CS_RECORDED_VERSION 1u
typedef struct cs_recorded {
  uint32_t version CS_INIT(CS_RECORDED_VERSION);
  uint32_t kind;   /* one CS_RECORDED value; 0 if there is no message */
  uint32_t events; /* CS_EVENT bits: what changed in the client */
  int32_t key;     /* 1 if it is a frame that can be decoded without earlier ones */
  double seconds;  /* time since the start of the recording */
  /* Tick of a frame, events, a tick or a checkpoint; the first tick with new parameters; else 0. */
  uint64_t tick;
  /* Frames: the hash that a decoder must have; compare with cs_reconstruction_hash. Else 0. */
  uint64_t reconstruction_hash;
  uint64_t state_hash; /* Frames and ticks: hash of the simulation's state after the tick. Else 0. */
} cs_recorded;

typedef enum cs_recording_result {
  CS_RECORDING_ERROR = -1, /* cs_recording_error_text */
  CS_RECORDING_END = 0,    /* no message of these kinds is left */
  CS_RECORDING_NEXT = 1    /* *out is the next message */
} cs_recording_result;

/* Reads up to the next message of `kinds`, a set of CS_RECORDED values, and gives it and all messages before
 * it to the client. out: only its version is read; it is unchanged unless the result is CS_RECORDING_NEXT.
 * A chunk of the file that cannot be read is an error, and so is a frame that cannot be decoded or differs
 * from its recorded hash, whatever the kinds: the next call continues after it. The frames that follow up to
 * the next key frame depend on it; they are left out without a further error, and cs_recording_get_faults
 * counts them. A malformed message ends the recording, and each later call reports it. */
cs_recording_result cs_recording_next(cs_recording* recording, uint32_t kinds, cs_recorded* out) CS_NOEXCEPT;
/* Goes to a time, in seconds since the start: the client shows the newest frame at or before it, as if the
 * recording had been played up to there, with the parameters and participants of this time. Decoding starts
 * at the key frame before. *out: this frame. Without such a frame its kind is 0, and the client shows the
 * rest state. out may be NULL. Statistics of the client continue. Fails if the recording is not open, the
 * time is not a number, the version is unknown, or the bytes cannot be read. */
int cs_recording_seek(cs_recording* recording, double seconds, cs_recorded* out) CS_NOEXCEPT;
/* Like cs_recording_seek, to the newest frame with this tick or an earlier one. */
int cs_recording_seek_tick(cs_recording* recording, uint64_t tick, cs_recorded* out) CS_NOEXCEPT;

#define CS_RECORDING_FAULTS_VERSION 1u
/* Frames that were read so far. Frames that are read again after a seek count again. */
typedef struct cs_recording_faults {
  uint32_t version CS_INIT(CS_RECORDING_FAULTS_VERSION);
  uint64_t frames;      /* all frames */
  uint64_t undecodable; /* frames that the decoder refused, or that refer to one that differs */
  uint64_t different;   /* frames that were decoded, but differ from their recorded hash */
  /* The first of the last two: its tick, 0 if its header cannot be read, and its time since the start. */
  uint64_t first_tick;
  double first_seconds;
} cs_recording_faults;
/* Fails if the recording is not open or `out->version` is unknown. A program that has read a whole recording
 * without an error has seen every frame; the counts are then 0. */
int cs_recording_get_faults(const cs_recording* recording, cs_recording_faults* out) CS_NOEXCEPT;

/* The newest message, as in the file: serialised protobuf of the type that docs/recording.md lists. NULL and
 * 0 before the first, and after a seek. */
const uint8_t* cs_recording_message(const cs_recording* recording, size_t* bytes) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Journal: the input of each tick and the exact states that a server has recorded.
 */

/* Recovery of recording.proto: change of the state before a tick. */
typedef enum cs_recovery {
  CS_RECOVERY_NONE = 0,
  CS_RECOVERY_ROLLBACK = 1, /* return to the newest state that the device saved */
  CS_RECOVERY_RESET = 2     /* return to the start */
} cs_recovery;

#define CS_RECORDED_TICK_VERSION 1u
typedef struct cs_recorded_tick {
  uint32_t version CS_INIT(CS_RECORDED_TICK_VERSION);
  uint32_t recovery;   /* cs_recovery, or a newer value */
  uint64_t tick;       /* grows by one per tick, also after a rollback or reset */
  uint64_t state_hash; /* hash of positions and velocities after the tick */
  int32_t unhealthy;   /* 1: a number left its allowed range */
  int32_t saves_state; /* 1: the device saved the state before this tick */
  float gravity[3];    /* m/s^2 */
  float wind[3];       /* m/s, gust included */
  float air_density;   /* kg/m^3 */
  uint32_t substeps;   /* 0: as many as the scene has; else fewer, because the device was overloaded */
  uint32_t collider_count, attachment_count, grab_count;
} cs_recorded_tick;

typedef struct cs_recorded_pose {
  float position[3];    /* m */
  float orientation[4]; /* quaternion x y z w */
} cs_recorded_pose;

#define CS_RECORDED_COLLIDER_VERSION 1u
/* Collider that moves during a tick. */
typedef struct cs_recorded_collider {
  uint32_t version CS_INIT(CS_RECORDED_COLLIDER_VERSION);
  uint64_t participant_id;       /* 0: the scene */
  uint32_t id;                   /* among the colliders of the participant; of the scene: its index */
  uint32_t shape;                /* cs_shape */
  cs_recorded_pose start, end;   /* at the start and end of the tick */
  float friction;                /* coefficient */
  float radius, length, size[3]; /* m; 0 if the shape does not have them */
  float top_radius;              /* m; as in cs_collider */
} cs_recorded_collider;

/* AppliedGripState of recording.proto. */
typedef enum cs_grab_state {
  CS_GRAB_STATE_FREE = 0,  /* the grab holds nothing; the other members of its struct have no meaning */
  CS_GRAB_STATE_HOLDS = 1, /* the grab holds the nodes that it has */
  CS_GRAB_STATE_TAKES = 2  /* the grab takes the nodes near its start, or near its place */
} cs_grab_state;

#define CS_RECORDED_GRAB_VERSION 1u
typedef struct cs_recorded_grab {
  uint32_t version CS_INIT(CS_RECORDED_GRAB_VERSION);
  uint32_t state;                                /* cs_grab_state, or a newer state */
  cs_recorded_pose start, end;                   /* at the start and end of the tick */
  float radius, reach, max_force, slip_distance; /* m, m, N, m */
} cs_recorded_grab;

/* The newest CS_RECORDED_TICK at or before the place in the recording. Fails before the first, after a seek
 * to a place without one between its key frame and its frame, or if `out->version` is unknown. */
int cs_recording_get_tick(const cs_recording* recording, cs_recorded_tick* out) CS_NOEXCEPT;
/* Colliders in the order in which they act: those of the scene, then those of participants. Attachments in
 * the order of the cloths of the scene, at the end of the tick. Grabs by their index in the simulation. Each
 * function fails if the index is out of range. */
int cs_recording_get_collider(const cs_recording* recording, uint32_t index,
                              cs_recorded_collider* out) CS_NOEXCEPT;
int cs_recording_get_attachment(const cs_recording* recording, uint32_t index,
                                cs_recorded_pose* out) CS_NOEXCEPT;
int cs_recording_get_grab(const cs_recording* recording, uint32_t index, cs_recorded_grab* out) CS_NOEXCEPT;

/* The newest CS_RECORDED_CHECKPOINT: 6 floats for each of *node_count nodes, position (m) and velocity (m/s),
 * and the tick after which they hold. tick may be NULL. Returns NULL and 0 before the first, and after a seek
 * to a place without one between its key frame and its frame. */
const float* cs_recording_state(const cs_recording* recording, uint32_t* node_count,
                                uint64_t* tick) CS_NOEXCEPT;

/* NOLINTEND(modernize-use-using) */

#ifdef __cplusplus
}
#endif
#endif
