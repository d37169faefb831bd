/* SPDX-License-Identifier: MIT
 * C interface of the client core. The core does no input or output: it takes bytes from the server and
 * returns bytes to send. It is the same library natively and as WebAssembly.
 *
 * Transport: the program owns the connection. It passes each serialised ServerMessage to cs_receive and sends
 * each message that cs_next_outgoing returns as one ClientMessage. It reports connections with cs_connecting
 * and cs_disconnected, and opens a new one at the time that cs_connect_at returns. A client that reconnects
 * in time remains the same participant, with the colliders and grabs that it had.
 *
 * Times (now_us): microseconds of one monotonic clock, chosen by the caller.
 *
 * Threads: a client is not thread-safe. Call its functions from one thread at a time.
 *
 * Errors: no function throws or aborts because of the bytes it receives. Memory is bounded by cs_limits: a
 * description that is arriving, and geometry in proportion to its vertices and triangles. If memory runs out,
 * the native library ends the program and WebAssembly traps.
 *
 * Pointers and strings that a function returns belong to the client. They stay valid until the next
 * cs_receive on the same client unless the function says otherwise. Strings are UTF-8 and never NULL.
 * Arguments may be freed when the function returns. A pointer argument must not be NULL unless the function
 * says that it may be.
 *
 * A function that returns int returns 1 on success and 0 on failure. On failure it leaves *out
 * unchanged unless the function says otherwise.
 *
 * Structs with a `version`: set it to the CS_..._VERSION of this header before the call; in C++ it is set
 * from the start. A call with an unknown version fails. Later versions add fields at the end. The elements of
 * an array have the same version.
 *
 * Units are SI unless a comment or a name says otherwise. Coordinates are right-handed with +Y up, in metres.
 *
 * Sections: lifetime, scenes, frames, play-out, mirror, input, parameters, participants, recording,
 * statistics, datagrams.
 */
#ifndef CLOTHSTREAM_CLIENTS_CORE_CORE_H
#define CLOTHSTREAM_CLIENTS_CORE_CORE_H

#include <stddef.h>
#include <stdint.h>

/* No exception leaves a function. */
#ifdef __cplusplus
#define CS_NOEXCEPT noexcept
#define CS_INIT(value) = value
extern "C" {
#else
#define CS_NOEXCEPT
#define CS_INIT(value)
#endif

/* NOLINTBEGIN(modernize-use-using): C has no using. */

/* ---------------------------------------------------------------------------------------------------------------
 * Lifetime: create a client, connect it, exchange messages, read its state.
 */

#define CS_PROTOCOL_VERSION 1u

typedef struct cs_client cs_client;

typedef enum cs_state {
  CS_STATE_JOINING = 0, /* Hello waits to be sent or to be answered */
  CS_STATE_JOINED = 1,  /* the description is complete; frames follow */
  CS_STATE_FAILED = 2,  /* final; cs_error_text says why */
  /* The connection is lost. The last description and frame can still be read. Poses and grabs are kept, and
   * sent after the reconnect. All other requests are dropped. */
  CS_STATE_RECONNECTING = 3
} cs_state;

/* Bits that cs_receive returns: what changed. */
enum {
  CS_EVENT_FRAME = 1,            /* new positions */
  CS_EVENT_DESCRIPTION = 2,      /* new cloths, vertex counts and triangles */
  CS_EVENT_NOTICE = 4,           /* cs_notice_text */
  CS_EVENT_ERROR = 8,            /* cs_error_text; fatal if the state is CS_STATE_FAILED */
  CS_EVENT_PARAMETERS = 16,      /* a parameter changed */
  CS_EVENT_SCENES = 32,          /* the answer to cs_list_scenes */
  CS_EVENT_REPORT = 64,          /* cs_get_cloth_report */
  CS_EVENT_GRABS = 128,          /* cs_grab_event_count */
  CS_EVENT_CONTACTS = 256,       /* cs_contact_event_count */
  CS_EVENT_PARTICIPANTS = 512,   /* cs_participant_count */
  CS_EVENT_PRESENCE = 1024,      /* cs_get_presence: why the participants changed */
  CS_EVENT_RETURNED = 2048,      /* joined again after a lost connection; see cs_resumed */
  CS_EVENT_PLAYBACK = 4096,      /* cs_get_playback */
  CS_EVENT_TOKEN = 8192,         /* pairing has given a token: keep cs_token */
  CS_EVENT_PAIRING_CODE = 16384, /* cs_get_pairing_code */
  CS_EVENT_ANSWER = 32768,       /* cs_get_answer: a request about scenes succeeded or failed */
  CS_EVENT_MOVING = 65536,       /* cs_next_server: the scene moves there soon */
  CS_EVENT_DATAGRAMS = 131072,   /* cs_get_datagram_answer: the server has answered an offer */
  CS_EVENT_SURFACES = 262144     /* cs_room_surface_count: surfaces of others have changed */
};

/* Values of cs_error_code after which the program asks its user for a token or a pairing code. */
enum {
  CS_ERROR_UNAUTHENTICATED = 60,   /* the server requires a token, and has got none that is valid */
  CS_ERROR_WRONG_PAIRING_CODE = 61 /* the code is wrong, or the address has sent too many wrong ones */
};

/* Role of session.proto. */
typedef enum cs_role {
  CS_ROLE_UNSPECIFIED = 0, /* in a request: the server chooses; in an answer: not known yet */
  CS_ROLE_VIEWER = 1,
  CS_ROLE_PARTICIPANT = 2,
  CS_ROLE_OWNER = 3
} cs_role;

#define CS_CLIENT_OPTIONS_VERSION 1u
/* Strings are copied. NULL means "". */
typedef struct cs_client_options {
  uint32_t version CS_INIT(CS_CLIENT_OPTIONS_VERSION);
  uint32_t role;            /* requested cs_role */
  const char* scene;        /* "" means the server's default scene */
  const char* client_name;  /* name of the program */
  const char* display_name; /* name for other participants; may be "" */
} cs_client_options;

/* Creates a client that joins a scene. Its first outgoing message is Hello. Free the client with cs_destroy.
 * Returns NULL if the version is unknown. */
cs_client* cs_create(const cs_client_options* options) CS_NOEXCEPT;
/* Frees the client and all pointers it returned. NULL is allowed. */
void cs_destroy(cs_client* client) CS_NOEXCEPT;
/* Limits what the server sends. Call before the first cs_next_outgoing. A later call does not affect the
 * current connection; it takes effect at the next one. quality: best quality level, 0 to 3; 0 is the finest
 * and the default. */
void cs_want(cs_client* client, uint32_t quality) CS_NOEXCEPT;
/* Proof of identity for a server that requires one (docs/identity.md): a token, or a pairing code of six
 * digits. "" means none. The newer call replaces the older one. Call before the first cs_next_outgoing; a
 * later call takes effect at the next connection. After pairing, CS_EVENT_TOKEN reports the server's token,
 * with which the client reconnects. Keep it secret. */
void cs_set_token(cs_client* client, const char* token) CS_NOEXCEPT;
void cs_set_pairing_code(cs_client* client, const char* code) CS_NOEXCEPT;
/* Sends a new token on the current connection, which then lasts until the new one expires. Later connections
 * use it as soon as the server has accepted it. It must be of the same subject and tenant; CS_EVENT_ERROR
 * reports a refusal. Fails, and changes nothing, before CS_STATE_JOINED and for "". */
int cs_renew_token(cs_client* client, const char* token) CS_NOEXCEPT;
/* Returns the token that is in use; "" without one. */
const char* cs_token(const cs_client* client) CS_NOEXCEPT;
/* Text with which a later client returns as the participant of this one, for example after a restart of the
 * program: with the same id, name and role, and without its colliders and grabs. "" before the first Welcome.
 * It works if the connection of this client is lost, not left, and for the server's reconnect grace. Valid
 * until the next call of this function. Keep it secret. */
const char* cs_resume_token(cs_client* client) CS_NOEXCEPT;
/* Returns as the participant of an earlier client. "" means none. Call before the first cs_next_outgoing. If
 * the server no longer keeps the place, the client joins as a new participant; cs_resumed says which. Fails,
 * and changes nothing, if the text is not one of cs_resume_token. */
int cs_set_resume_token(cs_client* client, const char* token) CS_NOEXCEPT;
/* Sets a monotonic clock in microseconds for measuring decode_ms. NULL disables the measurement. The
 * WebAssembly module does not export this function. */
void cs_set_clock(cs_client* client, uint64_t (*now_us)(void)) CS_NOEXCEPT;

#define CS_LIMITS_VERSION 1u
/* Limits of what the client accepts from a server. A description that exceeds a limit leads to
 * CS_STATE_FAILED before its geometry is allocated; cs_error_text names the limit. A vertex takes about 250
 * bytes, a triangle about 30. */
typedef struct cs_limits {
  uint32_t version CS_INIT(CS_LIMITS_VERSION);
  uint32_t max_vertices;      /* of all cloths. 1 to 67108864. Default 1048576 */
  uint32_t max_triangles;     /* of all cloths. 1 to 134217728. Default 2097152 */
  uint32_t max_cloths;        /* 1 to 256. Default 256 */
  uint32_t max_participants;  /* 1 to 65536; a Welcome with more fails. Default 4096 */
  uint64_t max_content_bytes; /* of descriptions that are arriving. 1 to 268435456. Default 268435456 */
} cs_limits;
/* Fills in the version and the defaults. */
void cs_default_limits(cs_limits* out) CS_NOEXCEPT;
/* Replaces the limits for everything that arrives later. Fails, and changes nothing, if `limits` is NULL, or
 * if the version or a number is not allowed. */
int cs_set_limits(cs_client* client, const cs_limits* limits) CS_NOEXCEPT;

/* Processes one ServerMessage and returns a set of CS_EVENT bits. A malformed message leads to
 * CS_STATE_FAILED. */
uint32_t cs_receive(cs_client* client, const uint8_t* message, size_t bytes, uint64_t now_us) CS_NOEXCEPT;
/* Creates pings when they are due. Call at least ten times a second. A longer pause between two calls does
 * not count as silence of the server. */
void cs_update(cs_client* client, uint64_t now_us) CS_NOEXCEPT;
/* Returns the next ClientMessage to send, and its size in *bytes. Returns NULL if no message waits. The
 * pointer is valid until the next call of this function. */
const uint8_t* cs_next_outgoing(cs_client* client, size_t* bytes) CS_NOEXCEPT;

/* Reports that the transport starts to open a connection. An earlier connection ends. The next outgoing
 * message is Hello. Optional before the first connection. */
void cs_connecting(cs_client* client, uint64_t now_us) CS_NOEXCEPT;
/* Reports that the connection is lost or could not be opened. */
void cs_disconnected(cs_client* client, uint64_t now_us) CS_NOEXCEPT;
/* Returns when the transport must close its connection, if any, and open a new one: after a loss, after a
 * failed attempt, or after a long silence of the server. UINT64_MAX if no reconnect is scheduled. */
uint64_t cs_connect_at(const cs_client* client) CS_NOEXCEPT;
/* Tells whether the program opens connections at cs_connect_server. 0 is the default: a fatal NOT_FOUND then
 * leads to CS_STATE_FAILED although it names a server, and after CUT_OFF the client returns to the same
 * address. Call it also on a mirror. */
void cs_follow_redirects(cs_client* client, int on) CS_NOEXCEPT;
/* Returns the DNS name of the server at which to open the next connection, with the scheme, port and path of
 * the program's address. Check its certificate against this name. "" means the host of that address. Call it
 * each time before cs_connecting.
 *
 * With cs_follow_redirects(client, 1), a fatal NOT_FOUND or CUT_OFF with a cs_error_server is a redirect: the
 * scene is there. It is neither CS_EVENT_ERROR nor CS_STATE_FAILED. The server ends the connection, and
 * cs_connect_at schedules the next one as after a loss. Later connections go there too, except for each
 * fourth attempt while that server does not answer. Three redirects within a minute are followed without a
 * joined stream in between. The next one, and a NOT_FOUND that names the present server, lead to
 * CS_STATE_FAILED. */
const char* cs_connect_server(const cs_client* client) CS_NOEXCEPT;
/* Returns the DNS name of the server to which the scene moves soon, of the newest CS_EVENT_MOVING on this
 * connection; "" if there was none. Reported with cs_follow_redirects(client, 1) only, and at most three
 * times within a minute. The program may open a connection there as for cs_connect_server, send nothing on
 * it, and use it when cs_connect_server returns this name. */
const char* cs_next_server(const cs_client* client) CS_NOEXCEPT;
/* Returns 1 if the last Welcome resumed the participant of this client, or of the one before it
 * (cs_set_resume_token), else 0. */
int cs_resumed(const cs_client* client) CS_NOEXCEPT;

cs_state cs_get_state(const cs_client* client) CS_NOEXCEPT;
/* Returns the last error as a sentence; "" if there was none. */
const char* cs_error_text(const cs_client* client) CS_NOEXCEPT;
/* Returns the server's ErrorCode (session.proto) of the last error; 0 if the client itself found the
 * error. */
uint32_t cs_error_code(const cs_client* client) CS_NOEXCEPT;
/* Returns the DNS name of the server that has the scene, of the last error; "" if the error named none. It
 * has at most 253 bytes out of [A-Za-z0-9.-] and is no address. */
const char* cs_error_server(const cs_client* client) CS_NOEXCEPT;
/* Returns the text of the last CS_EVENT_NOTICE; "" if there was none. */
const char* cs_notice_text(const cs_client* client) CS_NOEXCEPT;
/* Returns the participant who caused the notice; 0 for the server or a person outside the scene. */
uint64_t cs_notice_participant(const cs_client* client) CS_NOEXCEPT;

/* Names of the server, its device and the joined scene; "" before Welcome. */
const char* cs_server_name(const cs_client* client) CS_NOEXCEPT;
const char* cs_device_name(const cs_client* client) CS_NOEXCEPT;
const char* cs_scene_name(const cs_client* client) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Scenes: list the server's scenes, make, control, record and delete them.
 *
 * A function that returns a uint64_t sends a request and returns its id. It returns 0, and sends nothing, if
 * the state is not CS_STATE_JOINED or 64 requests wait. CS_EVENT_ANSWER reports the answer, also if the
 * server refuses the request; CS_EVENT_ERROR does not follow then. A lost connection ends all requests
 * without an answer, because the client cannot know whether the server has carried them out. A scene named
 * "" is the one that the client has joined.
 */

#define CS_SCENE_SUMMARY_VERSION 1u
typedef struct cs_scene_summary {
  uint32_t version CS_INIT(CS_SCENE_SUMMARY_VERSION);
  const char *name, *description;
  uint32_t vertex_count, cloth_count;      /* of all cloths */
  uint32_t participants, max_participants; /* connected ones; and including those that are away */
  int32_t running;                         /* 1 if it is simulated now */
  int32_t paused;                          /* 1 if its clock is stopped */
  int32_t created;                         /* 1 if a client made it; only then it can be deleted */
  int32_t recorded;                        /* 1 if the server records it to a file */
  int32_t is_recording;                    /* 1 if it is a recording that is played */
} cs_scene_summary;

/* Requests the list of the server's scenes. The answer comes with CS_EVENT_SCENES. */
void cs_list_scenes(cs_client* client) CS_NOEXCEPT;
/* Number of scenes in the last answer. */
uint32_t cs_scene_count(const cs_client* client) CS_NOEXCEPT;
/* Fails if the index is out of range. */
int cs_get_scene(const cs_client* client, uint32_t index, cs_scene_summary* out) CS_NOEXCEPT;

typedef enum cs_request {
  CS_REQUEST_CREATE_SCENE = 1,
  CS_REQUEST_DELETE_SCENE = 2,
  CS_REQUEST_CONTROL_SCENE = 3,
  CS_REQUEST_START_RECORDING = 4,
  CS_REQUEST_STOP_RECORDING = 5,
  CS_REQUEST_GET_SCENE = 6,
  CS_REQUEST_LIST_BANS = 7,
  CS_REQUEST_LIFT_BAN = 8
} cs_request;

#define CS_ANSWER_VERSION 1u
typedef struct cs_answer {
  uint32_t version CS_INIT(CS_ANSWER_VERSION);
  uint32_t request;       /* cs_request */
  uint64_t request_id;    /* id that the function returned */
  uint32_t error;         /* ErrorCode (session.proto); 0 if the request succeeded */
  const char* error_text; /* what was wrong and what is allowed; "" if the request succeeded */
  /* Name of the scene (create, control) or of the file (start and stop recording); else "". */
  const char* name;
  uint64_t bytes; /* size of the file (stop recording); else 0 */
  /* Repairs of the meshes of a new scene (`Mesh.repair` of scene.proto), one sentence a line; else
   * "". */
  const char* repairs;
} cs_answer;
/* The newest answer. Fails before the first, or if `out->version` is unknown. */
int cs_get_answer(const cs_client* client, cs_answer* out) CS_NOEXCEPT;

#define CS_MAX_SCENE_BYTES 268435456u
/* Creates a scene from a serialised Scene (scene.proto). A scene of more than 60 KiB is uploaded in pieces
 * first, for which cs_update must be called. name: name of the new scene; "" means the one in the definition.
 * max_participants: 0 means the server's limit. The bytes are copied. Also returns 0 if another upload is
 * under way, or if `bytes` is 0 or above CS_MAX_SCENE_BYTES. */
uint64_t cs_create_scene(cs_client* client, const uint8_t* scene, size_t bytes, const char* name,
                         uint32_t max_participants) CS_NOEXCEPT;
/* Creates a scene as a copy of another scene of the server or of a built-in scene. */
uint64_t cs_copy_scene(cs_client* client, const char* source, const char* name,
                       uint32_t max_participants) CS_NOEXCEPT;
/* Progress of the upload of cs_create_scene: bytes that the server has received, and all bytes. Fails if no
 * upload is under way. */
int cs_get_upload(const cs_client* client, uint64_t* sent_bytes, uint64_t* bytes) CS_NOEXCEPT;
/* Deletes a scene that a client made. All participants of it are removed. */
uint64_t cs_delete_scene(cs_client* client, const char* scene) CS_NOEXCEPT;
/* Puts all cloths back to their start. Parameters stay. A recording returns to its start. */
uint64_t cs_reset_scene(cs_client* client, const char* scene) CS_NOEXCEPT;
/* Stops or restarts the clock of a scene. */
uint64_t cs_pause_scene(cs_client* client, const char* scene, int paused) CS_NOEXCEPT;
/* Starts a recording on the server. file: 1 to 64 characters out of [A-Za-z0-9_-], without an extension; ""
 * means that the server chooses. The answer names the file. */
uint64_t cs_start_recording(cs_client* client, const char* scene, const char* file) CS_NOEXCEPT;
/* Ends the recording of a scene. The answer has the name and size of the file. */
uint64_t cs_stop_recording(cs_client* client, const char* scene) CS_NOEXCEPT;
/* Requests the definition of a scene with its current parameters, at most 1 MiB. */
uint64_t cs_request_definition(cs_client* client, const char* scene) CS_NOEXCEPT;
/* The serialised Scene of the last answer, and its size in *bytes; NULL and 0 before the first. */
const uint8_t* cs_definition(const cs_client* client, size_t* bytes) CS_NOEXCEPT;

#define CS_BAN_VERSION 1u
/* A subject that may not join a scene (docs/identity.md). */
typedef struct cs_ban {
  uint32_t version CS_INIT(CS_BAN_VERSION);
  const char* subject;
  const char* display_name; /* name when the ban began; may be "" */
  const char* tenant;       /* may be "" */
} cs_ban;
/* Requests for owners: list the bans of a scene, and lift the ban of a subject. */
uint64_t cs_list_bans(cs_client* client, const char* scene) CS_NOEXCEPT;
uint64_t cs_lift_ban(cs_client* client, const char* scene, const char* subject) CS_NOEXCEPT;
/* Number of bans in the last answer. */
uint32_t cs_ban_count(const cs_client* client) CS_NOEXCEPT;
/* Fails if the index is out of range. */
int cs_get_ban(const cs_client* client, uint32_t index, cs_ban* out) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Frames: what the scene contains and the geometry of the newest frame.
 */

#define CS_CLOTH_VERSION 1u
typedef struct cs_cloth {
  uint32_t version CS_INIT(CS_CLOTH_VERSION);
  const char* name;
  uint32_t first_vertex, vertex_count;
  uint32_t rows, columns;            /* 0 if the cloth is not a grid */
  uint32_t first_index, index_count; /* range in cs_triangles */
} cs_cloth;

#define CS_SUBMESH_VERSION 1u
typedef struct cs_submesh {
  uint32_t version CS_INIT(CS_SUBMESH_VERSION);
  const char* name;                  /* may be "" */
  uint32_t first_index, index_count; /* range in cs_triangles */
} cs_submesh;

/* Shapes are solid. They are given in the collider's own frame, in metres. */
typedef enum cs_shape {
  CS_SHAPE_SPHERE = 0,  /* radius */
  CS_SHAPE_CAPSULE = 1, /* radius; length of the segment along Y, centred on the origin */
  CS_SHAPE_PLANE = 2,   /* the half-space y <= 0 */
  CS_SHAPE_BOX = 3,     /* size, centred on the origin */
  CS_SHAPE_HULL = 4     /* convex hull or closed mesh; see cs_get_hull */
} cs_shape;

#define CS_COLLIDER_VERSION 1u
typedef struct cs_collider {
  uint32_t version CS_INIT(CS_COLLIDER_VERSION);
  uint32_t shape;          /* cs_shape */
  const char* name;        /* of a collider of a participant: its id in decimal */
  uint64_t participant_id; /* 0 for a collider of the scene */
  float position[3];
  float orientation[4];          /* quaternion x y z w */
  float radius, length, size[3]; /* m; 0 if the shape does not have them */
  /* m. A tapered capsule has this radius at its end at +Y, and `radius` at its end at -Y. Other shapes have
   * the value of `radius`. */
  float top_radius;
  /* 1: the collider yields. It is not where its participant put it, because cloth that nothing passes through
   * has no room there (docs/colliders.md). Else 0. */
  int32_t yields;
} cs_collider;

/* Frames per second of the stream, and ticks per second of the simulation; 0 before the description. */
uint32_t cs_stream_rate(const cs_client* client) CS_NOEXCEPT;
uint32_t cs_simulation_rate(const cs_client* client) CS_NOEXCEPT;
/* Returns n if the newest frame says that the server sends only each n-th frame of this rate, because its
 * device is overloaded: 1 to 1000. 1 means all frames, and is the value before the first frame. */
uint32_t cs_frame_divisor(const cs_client* client) CS_NOEXCEPT;

/* Number of vertices of all cloths; 0 before the description. */
uint32_t cs_vertex_count(const cs_client* client) CS_NOEXCEPT;
/* Positions and unit normals of the newest frame: 3 floats per vertex. Before the first frame they are those
 * of the rest state. */
const float* cs_positions(const cs_client* client) CS_NOEXCEPT;
const float* cs_normals(const cs_client* client) CS_NOEXCEPT;
/* Returns 1 if the server sends normals, else 0: then they are computed from the positions. */
int cs_sends_normals(const cs_client* client) CS_NOEXCEPT;
/* Hash of the newest decoded frame, for comparison with the server's; 0 before the first frame. */
uint64_t cs_reconstruction_hash(const cs_client* client) CS_NOEXCEPT;

/* Vertex indices of all cloths, 3 per triangle, counter-clockwise seen from the front. The front of a grid
 * faces +Z of the grid. Valid until the next CS_EVENT_DESCRIPTION. */
const uint32_t* cs_triangles(const cs_client* client, uint32_t* index_count) CS_NOEXCEPT;
uint32_t cs_cloth_count(const cs_client* client) CS_NOEXCEPT;
/* Fails if the index is out of range. */
int cs_get_cloth(const cs_client* client, uint32_t index, cs_cloth* out) CS_NOEXCEPT;
/* Texture coordinates of a mesh: *count pairs {u, v}, v upwards. NULL and 0 if the cloth has none. Valid
 * until the next CS_EVENT_DESCRIPTION. */
const float* cs_uvs(const cs_client* client, uint32_t cloth, uint32_t* count) CS_NOEXCEPT;
/* Index into cs_uvs for each triangle corner of the cloth: index_count of them. NULL and 0 if the cloth has
 * no texture coordinates. Valid until the next CS_EVENT_DESCRIPTION. */
const uint32_t* cs_uv_indices(const cs_client* client, uint32_t cloth, uint32_t* count) CS_NOEXCEPT;
/* Number of parts of a mesh, one per material; 0 for a grid. */
uint32_t cs_submesh_count(const cs_client* client, uint32_t cloth) CS_NOEXCEPT;
/* Fails if an index is out of range. The name is valid until the next CS_EVENT_DESCRIPTION. */
int cs_get_submesh(const cs_client* client, uint32_t cloth, uint32_t index, cs_submesh* out) CS_NOEXCEPT;

/* Colliders of the scene and of all participants, as of the newest frame. */
uint32_t cs_collider_count(const cs_client* client) CS_NOEXCEPT;
/* Fails if the index is out of range. */
int cs_get_collider(const cs_client* client, uint32_t index, cs_collider* out) CS_NOEXCEPT;
/* Returns the corners (3 floats each) of a collider that is a hull or mesh, in its own frame. *triangles are
 * its corner indices, counter-clockwise seen from outside. Returns NULL and counts of 0 for other colliders.
 * Valid until the next CS_EVENT_DESCRIPTION. The corners of a mesh with joints are those of the shown time,
 * or of the newest frame without play-out, and are valid until the next call. */
const float* cs_get_hull(const cs_client* client, uint32_t index, uint32_t* vertex_count,
                         const uint32_t** triangles, uint32_t* index_count) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Play-out: shows smooth motion although frames arrive unevenly. Each frame is shown a delay after its tick
 * began. Between two frames, positions are interpolated.
 */

#define CS_PLAY_OUT_OPTIONS_VERSION 1u
typedef struct cs_play_out_options {
  uint32_t version CS_INIT(CS_PLAY_OUT_OPTIONS_VERSION);
  uint32_t frames; /* number of newest frames to keep, 3 to 256; must cover the delay */
  /* Delay from the start of a tick on the server to its display, 0 to 10000. NaN means adaptive: the shortest
   * delay with which 98 % of the last 2,048 frames, or all frames of the last second, would have arrived in
   * time, within the two limits below. The first 8 frames are slow while a connection starts: until then half
   * of them are in time, and later they do not count. The adaptive delay changes by at most 10 % of the
   * elapsed time; during the first 16 frames, by at most the elapsed time, and during the first 8 it falls at
   * once. */
  double delay_ms;
  double least_delay_ms, most_delay_ms; /* limits of the adaptive delay, 0 to 10000 */
  /* Maximum time of extrapolation if the next frame is missing, 0 to 1000. Over the same time the motion then
   * returns to the newest frame and stops. A key frame is not extrapolated because it may be a cut. */
  double lead_ms;
} cs_play_out_options;

typedef enum cs_shown {
  CS_SHOWN_NOTHING = 0, /* no frame arrived yet: rest positions */
  CS_SHOWN_FRAME = 1,   /* a frame at exactly its time, bit for bit */
  CS_SHOWN_BETWEEN = 2, /* interpolated linearly between two frames */
  CS_SHOWN_LED_ON = 3,  /* extrapolated (led on) beyond the newest frame */
  CS_SHOWN_HELD = 4     /* the nearest frame, held at another time */
} cs_shown;

#define CS_PLAYED_VERSION 1u
typedef struct cs_played {
  uint32_t version CS_INIT(CS_PLAYED_VERSION);
  uint32_t shown;          /* cs_shown */
  uint64_t tick;           /* tick of the frame that is shown, or from which interpolation starts */
  uint64_t server_time_us; /* display time minus delay, on the server's clock; 0 if the clock is unknown */
  double fraction;         /* part of the way to the next frame; if extrapolated, part of the last step */
} cs_played;

/* Turns play-out on; NULL turns it off. Default: off. Play-out keeps 12 bytes per vertex and frame, 24 if the
 * server sends normals, and two more frames for the result. The limit is 256 MiB: fewer frames are kept then,
 * but at least 3. A collider takes about 120 bytes per frame. Fails, and changes nothing, if a version or a
 * number is not allowed. */
int cs_set_play_out(cs_client* client, const cs_play_out_options* options) CS_NOEXCEPT;
/* Fills in the version and the defaults: 32 frames, adaptive delay of 0 to 250 ms, extrapolation for
 * 30 ms. */
void cs_default_play_out(cs_play_out_options* out) CS_NOEXCEPT;
/* Chooses what to show at display_time_us, which may be later than now_us. If display times grow from call to
 * call, server_time_us never goes back unless a clock jumps. The newest frame is held until the delay is
 * known. out may be NULL. Fails if play-out is off. */
int cs_play_out(cs_client* client, uint64_t now_us, uint64_t display_time_us, cs_played* out) CS_NOEXCEPT;
/* Turns local contact on or off. Default: off. The server answers to this participant's hand a round trip and
 * the delay of play-out late. With local contact, cs_play_out moves the cloth out of the way of the newest
 * hand, spheres and capsules meanwhile, and returns it as the answer comes: by at most 0.35 m/s besides the
 * motion of the hand. Boxes have no local contact. Nothing changes while play-out is off, or for viewers. It
 * takes about 70 bytes per vertex and 50 per triangle. */
void cs_set_local_contact(cs_client* client, int on) CS_NOEXCEPT;
/* Length of the largest correction by the last cs_play_out, m; 0 without one. */
float cs_local_correction(const cs_client* client) CS_NOEXCEPT;
/* Positions and unit normals that the last cs_play_out chose: 3 floats per vertex. Normals are interpolated
 * like positions if the server sends them, else computed from these positions; the first call does that work.
 * Valid until the next cs_play_out or cs_receive. */
const float* cs_played_positions(const cs_client* client) CS_NOEXCEPT;
const float* cs_played_normals(const cs_client* client) CS_NOEXCEPT;
/* Colliders of the scene and of all participants at the time that is shown. Between two frames they move in a
 * straight line and turn the shorter way. Exception: a collider that moves faster than 30 m/s or turns by
 * more than 120 degrees jumps. Colliders of the scene have the same index as in cs_get_collider. */
uint32_t cs_played_collider_count(const cs_client* client) CS_NOEXCEPT;
/* Fails if the index is out of range. The name is valid until the next cs_play_out or cs_receive. */
int cs_get_played_collider(const cs_client* client, uint32_t index, cs_collider* out) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Mirror: one participant in two threads. On one thread, a client has the connection and decodes. On the
 * other thread, which draws, its mirror has everything else: play-out, local contact, input, parameters,
 * statistics. Both may be in different modules of WebAssembly, without shared memory.
 *
 * The program passes all messages of the server to the client, and then to the mirror. It repeats its calls
 * of cs_connecting and cs_disconnected for the mirror, in the same order. It sends the messages of the client
 * first, and then those that cs_next_outgoing of the mirror returns. It ignores errors and answers that the
 * client reports and that do not end it: they belong to requests of the mirror. A mirror sends no Hello,
 * acknowledgements, and no requests for key frames except cs_request_key_frame. It sends pings only during an
 * upload (cs_create_scene), for which cs_update of the mirror must be called; otherwise cs_update and
 * cs_connect_at of a mirror have no use. Token and pairing code are set on the client, a resume token on
 * both. Times are of the same clock for both.
 */

typedef enum cs_decoding {
  CS_DECODING_DONE = 0,    /* the client decoded the frame */
  CS_DECODING_REFUSED = 1, /* the client could not decode it */
  CS_DECODING_SKIPPED = 2 /* the program does not pass the result on, or the frame was older than its state */
} cs_decoding;

#define CS_DECODED_VERSION 1u
/* Result of the client for a message with a frame. */
typedef struct cs_decoded {
  uint32_t version CS_INIT(CS_DECODED_VERSION);
  uint32_t decoding;            /* cs_decoding; the members below are read only for CS_DECODING_DONE */
  const float* positions;       /* cs_positions: 3 floats for each of vertex_count vertices */
  const float* normals;         /* cs_normals if the server sends normals; else ignored, may be NULL */
  uint32_t vertex_count;        /* cs_vertex_count of the client */
  uint64_t reconstruction_hash; /* cs_reconstruction_hash of the client */
  double decode_ms;             /* time that decoding took; 0: not measured */
} cs_decoded;

/* Like cs_create, for the mirror of a client with the same options. */
cs_client* cs_create_mirror(const cs_client_options* options) CS_NOEXCEPT;
/* Like cs_receive, for a mirror. `decoded` may be NULL for messages other than frames; a frame is then
 * skipped. A frame with an unknown version or another number of vertices is skipped too. */
uint32_t cs_receive_decoded(cs_client* mirror, const uint8_t* message, size_t bytes,
                            const cs_decoded* decoded, uint64_t now_us) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Input: colliders, hands, grabs, attachments and surfaces of this participant; events of grabs and contacts.
 *
 * now_us says for which time the pose holds; the server uses it to place the pose between ticks. It may be in
 * the near future, for example a headset's predicted display time. If the transport is slow, only the newest
 * poses are sent. A viewer's input stays in the client until the server gives it another role.
 */

#define CS_MAX_COLLIDERS 40u
#define CS_MAX_GRABS 10u
#define CS_MAX_WINDS 2u
#define CS_HAND_JOINTS 26u
#define CS_HAND_BONES 20u
/* Id of the collider that is the participant's head (docs/protocol.md). */
#define CS_HEAD_ID 0x80000040u

#define CS_OWN_COLLIDER_VERSION 1u
/* Collider of this participant: sphere, capsule or box. Numbers that the shape does not have are ignored. */
typedef struct cs_own_collider {
  uint32_t version CS_INIT(CS_OWN_COLLIDER_VERSION);
  uint32_t shape; /* cs_shape */
  float position[3];
  float orientation[4];          /* quaternion x y z w; all zero means no rotation */
  float radius, length, size[3]; /* m */
  float top_radius; /* m; of a tapered capsule, as in cs_collider; 0 means the value of `radius` */
} cs_own_collider;

#define CS_CLOTH_POINT_VERSION 1u
/* Point on a cloth as it is shown. */
typedef struct cs_cloth_point {
  uint32_t version CS_INIT(CS_CLOTH_POINT_VERSION);
  uint32_t triangle;   /* its corners are the entries 3 * triangle to 3 * triangle + 2 of cs_triangles */
  float second, third; /* barycentric coordinates of the second and third corner */
  float position[3];   /* m */
  float distance;      /* m, from the given point or from the origin of the ray */
  uint64_t tick;       /* of the frame that is shown */
} cs_cloth_point;

#define CS_GRAB_VERSION 1u
/* Grab of this participant (Grab in session.proto). NaN means the server's default. */
typedef struct cs_grab {
  uint32_t version CS_INIT(CS_GRAB_VERSION);
  uint32_t id; /* a new id takes hold; an id that is missing in the next call lets go */
  float position[3];
  float orientation[4]; /* quaternion x y z w; all zero means no rotation */
  float radius, reach;  /* m */
  float max_force;      /* N */
  float slip_distance;  /* m */
  /* The grab takes hold of this place, wherever the cloth has moved on the server by then, and draws it to
   * `position` within 0.2 s; `reach` has no effect. NULL: it takes what is near `position` on the server.
   * Only triangle, coordinates and tick of the place are used, and only when the grab starts. */
  const cs_cloth_point* place;
} cs_grab;

/* Kinds of LocalWind in scene.proto. */
typedef enum cs_wind_kind { CS_WIND_FAN = 0, CS_WIND_VORTEX = 1 } cs_wind_kind;

#define CS_OWN_WIND_VERSION 1u
/* Local wind that this participant holds (LocalWind in scene.proto). NaN means the server's default. */
typedef struct cs_own_wind {
  uint32_t version CS_INIT(CS_OWN_WIND_VERSION);
  uint32_t kind; /* cs_wind_kind */
  float position[3];
  float orientation[4]; /* quaternion x y z w that turns +Y to the axis; all zero means no rotation */
  float speed;          /* m/s */
  float radius;         /* m; of a fan's opening, or of a vortex's core */
  float spread;         /* of a fan: growth of its radius for each metre of distance */
  float reach;          /* m; a fan's range, or a vortex's reach */
} cs_own_wind;

#define CS_MAX_SURFACE_VERTICES 150000u
#define CS_MAX_SURFACE_TRIANGLES 50000u

#define CS_SURFACE_VERSION 1u
/* Surface of the real room of this participant: a triangle mesh that cloth does not pass through, such as a
 * floor, a desk, or a mesh that a headset has scanned (SurfaceUpdate in session.proto). */
typedef struct cs_surface {
  uint32_t version CS_INIT(CS_SURFACE_VERSION);
  uint32_t id; /* a known id replaces its surface */
  float position[3];
  float orientation[4];      /* quaternion x y z w; all zero means no rotation */
  const float* positions;    /* x, y, z of each vertex, -100 to 100, in the frame of the surface */
  uint32_t vertex_count;     /* at most CS_MAX_SURFACE_VERTICES */
  const uint32_t* triangles; /* three vertices of each triangle, counter-clockwise seen from the front */
  uint32_t triangle_count;   /* 1 to CS_MAX_SURFACE_TRIANGLES */
  uint32_t two_sided;        /* 1: cloth can be on both sides; 0: cloth passes it from behind */
  float friction;            /* coefficient of friction, 0 to 10, multiplied with the cloth's */
} cs_surface;

/* Policy of the server for surfaces of the real room. */
typedef enum cs_surface_policy {
  CS_SURFACES_UNKNOWN = 0, /* not connected yet, or the server is of a release that knows none */
  CS_SURFACES_OFF = 1,     /* it refuses them */
  CS_SURFACES_OWN = 2,     /* they act on the cloth, and their shape is sent to no client */
  CS_SURFACES_EVERYONE = 3 /* they act on the cloth, and everyone in the scene gets their shape */
} cs_surface_policy;

#define CS_ROOM_SURFACE_VERSION 1u
/* Surface of the real room of another participant. The arrays are valid until the next CS_EVENT_SURFACES. */
typedef struct cs_room_surface {
  uint32_t version CS_INIT(CS_ROOM_SURFACE_VERSION);
  uint32_t id; /* unique for its participant */
  uint64_t participant_id;
  uint64_t revision; /* differs from that of every other mesh of the scene */
  float position[3];
  float orientation[4];   /* quaternion x y z w */
  const float* positions; /* x, y, z of each vertex, in the frame of the surface */
  uint32_t vertex_count;
  const uint32_t* triangles; /* three vertices of each triangle, counter-clockwise seen from the front */
  uint32_t triangle_count;
  uint32_t two_sided; /* 1: cloth can be on both sides */
} cs_room_surface;

/* HandSide of session.proto. */
typedef enum cs_hand_side { CS_HAND_LEFT = 1, CS_HAND_RIGHT = 2 } cs_hand_side;

/* GrabEventKind of session.proto. */
typedef enum cs_grab_event_kind {
  CS_GRAB_TAKEN = 1,   /* the grab took hold */
  CS_GRAB_SLIPPED = 2, /* the grab lost some or all of its vertices */
  CS_GRAB_RELEASED = 3 /* the participant let go or left */
} cs_grab_event_kind;

#define CS_GRAB_EVENT_VERSION 1u
typedef struct cs_grab_event {
  uint32_t version CS_INIT(CS_GRAB_EVENT_VERSION);
  uint64_t participant_id;
  uint32_t grab_id;
  uint32_t kind;     /* cs_grab_event_kind, or a newer kind */
  uint32_t vertices; /* number of vertices that the grab holds now */
  /* Only when a grab with a place took hold: distance between its position and the place at that moment, m,
   * and ticks since the frame in which the place was seen (0: unknown). */
  float distance;
  uint64_t ticks_since_seen;
} cs_grab_event;

/* ContactEventKind of session.proto. */
typedef enum cs_contact_event_kind { CS_CONTACT_BEGAN = 1, CS_CONTACT_ENDED = 2 } cs_contact_event_kind;

#define CS_CONTACT_EVENT_VERSION 1u
typedef struct cs_contact_event {
  uint32_t version CS_INIT(CS_CONTACT_EVENT_VERSION);
  uint32_t kind;        /* cs_contact_event_kind, or a newer kind */
  uint32_t collider_id; /* participant's collider: index in cs_set_colliders, bone of a hand, or CS_HEAD_ID */
  uint64_t participant_id; /* 0 for a collider of the scene */
  const char* collider;    /* name of the scene's collider */
  const char* cloth;
  float impulse; /* N s; in the first tick if the contact began, over the whole contact if it ended */
  float seconds; /* duration of the contact; 0 if it began */
} cs_contact_event;

/* Replaces the colliders of this participant; a count of 0 removes all. At most CS_MAX_COLLIDERS are used,
 * and at most 20 if two hands are set; the rest is ignored. Fails, and changes nothing, if a version is
 * unknown. */
int cs_set_colliders(cs_client* client, const cs_own_collider* colliders, uint32_t count,
                     uint64_t now_us) CS_NOEXCEPT;
/* Replaces one tracked hand; 0 joints remove it. Each joint is {x, y, z, radius} in metres. `count` is
 * CS_HAND_JOINTS in the order of OpenXR's XrHandJointEXT (palm first), or one less in the order of WebXR's
 * XRHand (no palm). The server builds CS_HAND_BONES capsules from it, which count as colliders of this
 * participant. Fails, and changes nothing, if the side or the count is not allowed. */
int cs_set_hand(cs_client* client, uint32_t side, const float* joints, uint32_t count,
                uint64_t now_us) CS_NOEXCEPT;
/* Replaces the head: a sphere with the id CS_HEAD_ID, by which others recognise it. It looks along -Z of its
 * own frame. It counts as a collider of this participant. orientation4 is a quaternion x y z w; NULL means
 * unknown. A NULL position3 removes the head. */
void cs_set_head(cs_client* client, const float* position3, const float* orientation4, float radius,
                 uint64_t now_us) CS_NOEXCEPT;
/* Finds the point of a cloth that is nearest to a point, or the first one that a ray meets, among the
 * positions that are shown: cs_played_positions if play-out is on, else cs_positions. The direction may have
 * any length. Fails, and changes nothing, without such a point within max_distance metres, or if a number is
 * not finite. */
int cs_nearest_point(const cs_client* client, const float* point3, float max_distance,
                     cs_cloth_point* out) CS_NOEXCEPT;
int cs_cast_ray(const cs_client* client, const float* origin3, const float* direction3, float max_distance,
                cs_cloth_point* out) CS_NOEXCEPT;

/* Replaces the grabs of this participant. At most CS_MAX_GRABS are used; the rest is ignored. Fails, and
 * changes nothing, if a version is unknown. */
int cs_set_grabs(cs_client* client, const cs_grab* grabs, uint32_t count, uint64_t now_us) CS_NOEXCEPT;
/* Replaces the local winds of this participant, which needs the permission to change the environment. At most
 * CS_MAX_WINDS are used; the rest is ignored. Fails, and changes nothing, if a version or kind is unknown. */
int cs_set_winds(cs_client* client, const cs_own_wind* winds, uint32_t count, uint64_t now_us) CS_NOEXCEPT;
/* Moves an attachment of the scene; it stays there. orientation4 may be NULL: no rotation. If it jumps, its
 * cloth goes along at once, however short the way is: use this for teleports and cuts of an animation. */
void cs_move_attachment(cs_client* client, const char* attachment, const float* position3,
                        const float* orientation4, int jumps, uint64_t now_us) CS_NOEXCEPT;
/* Moves the joints of a collider of the scene that is a mesh with joints; they stay there. `poses` has seven
 * numbers for each joint: position and quaternion x, y, z, w, relative to its parent. At most 128 joints are
 * used; the rest is ignored. If they jump, they are there in one tick, however far the way is, and the cloth
 * that follows them goes along: use this for teleports and cuts of an animation. */
void cs_move_joints(cs_client* client, const char* collider, const float* poses, uint32_t count, int jumps,
                    uint64_t now_us) CS_NOEXCEPT;

/* Parts of a body that are tracked. Left and right are those of the person. */
typedef enum cs_body_part {
  CS_BODY_HEAD = 1,
  CS_BODY_LEFT_HAND = 2,
  CS_BODY_RIGHT_HAND = 4,
  CS_BODY_HIPS = 8,
  CS_BODY_LEFT_ELBOW = 16,
  CS_BODY_RIGHT_ELBOW = 32,
  CS_BODY_LEFT_ANKLE = 64,
  CS_BODY_RIGHT_ANKLE = 128
} cs_body_part;

#define CS_TRACKED_BODY_VERSION 1u
/* What is known of a person, in the scene, whose +Y is up. Poses are position (m) and quaternion x y z w. */
typedef struct cs_tracked_body {
  uint32_t version CS_INIT(CS_TRACKED_BODY_VERSION);
  uint32_t
      parts;   /* sum of the cs_body_part that are tracked; CS_BODY_HEAD is required, others have no effect */
  float floor; /* height of the floor, m */
  float head[7]; /* between the eyes; looks along -Z */
  /* Wrists: the fingers point along -Z, and the back of the hand to +Y, as WebXR and OpenXR have it. */
  float left_hand[7], right_hand[7];
  /* Joints of body tracking, m. */
  float hips[3], left_elbow[3], right_elbow[3], left_ankle[3], right_ankle[3];
} cs_tracked_body;

/* Returns 1 if the collider with this index is a human body that can be worn: a mesh with joints whose names
 * say hips, head, arms and forearms (docs/bodies.md); else 0. Servers that do not know bodies send no names
 * of joints. */
int cs_is_body(const cs_client* client, uint32_t collider) CS_NOEXCEPT;
/* Takes a collider of the scene as the body of this participant, and gives back the one that it has; NULL or
 * "" only gives back. The body stands where it is shown now. CS_EVENT_PRESENCE announces the result to
 * everyone. If the server refuses, because another participant wears the body for example, CS_EVENT_ERROR
 * follows, and this participant keeps the body that it had. Fails, and sends nothing, if there is no such
 * body. */
int cs_wear(cs_client* client, const char* collider) CS_NOEXCEPT;
/* Name of the collider that a participant wears; "" for none. */
const char* cs_body_of(const cs_client* client, uint64_t participant_id) CS_NOEXCEPT;
/* Bends the body that this client wears to a person, and sends its joints. Call it once for each displayed
 * frame. It jumps if it is the first call, or the head has moved by more than 1 m. Fails, and changes
 * nothing, without a body or a tracked head, if a number is not finite, or for an unknown version. */
int cs_set_body(cs_client* client, const cs_tracked_body* tracked, uint64_t now_us) CS_NOEXCEPT;
/* Where the newest cs_set_body has put a cs_body_part: position and quaternion x y z w. A wrist that is
 * nearer to the tracked one than 2 cm is within the reach of the arm. Fails before, or if the body has no
 * such part. */
int cs_get_body_part(const cs_client* client, uint32_t part, float* pose7) CS_NOEXCEPT;
/* Poses of all joints that the newest cs_set_body has sent, as in cs_move_joints; NULL and 0 before. */
const float* cs_body_joints(const cs_client* client, uint32_t* count) CS_NOEXCEPT;
/* Corners of the triangles of a body (cs_get_hull) that its neck and head do not move, for the view out of
 * the head. NULL and 0 if it is not a body. Valid until the next call. */
const uint32_t* cs_body_below_neck(const cs_client* client, uint32_t collider,
                                   uint32_t* index_count) CS_NOEXCEPT;

/* Returns the policy of the server for surfaces of the real room, from the newest Welcome. */
cs_surface_policy cs_get_surface_policy(const cs_client* client) CS_NOEXCEPT;
/* Says how far the policy of the server may go for surfaces to be sent: CS_SURFACES_OWN (default), or
 * CS_SURFACES_EVERYONE. The shape of a home is private: ask the user first. If it may go less far than
 * before, the server is asked to remove the surfaces that it has; if it may go further, they are sent. */
void cs_allow_surfaces(cs_client* client, uint32_t policy) CS_NOEXCEPT;
/* Adds a surface of the real room, or replaces the one with its id. The mesh is copied, and sent again after
 * a reconnect. It acts when it has arrived completely; until then the former one does. Fails, and changes
 * nothing, if the version is unknown, if a count is not allowed, or if the client is in a scene whose server
 * takes no surfaces, or whose policy goes further than cs_allow_surfaces says. If the client joins such a
 * scene later, CS_EVENT_ERROR says so. */
int cs_set_surface(cs_client* client, const cs_surface* surface) CS_NOEXCEPT;
/* Moves a surface, which stands in its new pose from the next tick on. orientation4 may be NULL: no rotation.
 * Fails if there is no surface with this id. */
int cs_move_surface(cs_client* client, uint32_t id, const float* position3,
                    const float* orientation4) CS_NOEXCEPT;
/* Removes a surface. Fails if there is no surface with this id. */
int cs_remove_surface(cs_client* client, uint32_t id) CS_NOEXCEPT;

/* Gets the surfaces of others, if the policy of the server is CS_SURFACES_EVERYONE. Default: off. */
void cs_follow_surfaces(cs_client* client, int on) CS_NOEXCEPT;
/* Number of surfaces of others whose meshes have arrived. */
uint32_t cs_room_surface_count(const cs_client* client) CS_NOEXCEPT;
/* Fails if the index is out of range or the version is unknown. */
int cs_get_room_surface(const cs_client* client, uint32_t index, cs_room_surface* out) CS_NOEXCEPT;

/* Number of events in the newest CS_EVENT_GRABS, for the grabs of all participants. */
uint32_t cs_grab_event_count(const cs_client* client) CS_NOEXCEPT;
/* Fails if the index is out of range. */
int cs_get_grab_event(const cs_client* client, uint32_t index, cs_grab_event* out) CS_NOEXCEPT;

/* Turns CS_EVENT_CONTACTS on or off. Default: off. */
void cs_want_contacts(cs_client* client, int wants, uint64_t now_us) CS_NOEXCEPT;
/* Number of events in the newest CS_EVENT_CONTACTS. */
uint32_t cs_contact_event_count(const cs_client* client) CS_NOEXCEPT;
/* Fails if the index is out of range. */
int cs_get_contact_event(const cs_client* client, uint32_t index, cs_contact_event* out) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Parameters: read and change the environment, cloths and colliders of the scene.
 *
 * Values include the changes of all participants. A change is sent to the server; CS_EVENT_PARAMETERS follows
 * when it took effect. In changes, a NULL pointer keeps a value, and the cloth name "" means every cloth.
 */

#define CS_ENVIRONMENT_VERSION 1u
typedef struct cs_environment {
  uint32_t version CS_INIT(CS_ENVIRONMENT_VERSION);
  float gravity[3];    /* m/s^2 */
  float wind[3];       /* m/s */
  float air_density;   /* kg/m^3 */
  float gust_strength; /* m/s; maximum deviation of each wind component; 0 means no gusts */
  float gust_seconds;  /* time between changes of the gust's direction */
} cs_environment;

/* Solver.kind of scene.proto. */
typedef enum cs_solver {
  CS_SOLVER_AS_IS = 0, /* in a change: keeps the solver */
  CS_SOLVER_MASS_SPRING = 1,
  CS_SOLVER_CONSTRAINT = 2,
  CS_SOLVER_ACAD = 3,
  CS_SOLVER_XPBD = 4,
  CS_SOLVER_IMPLICIT_EULER = 5
} cs_solver;

#define CS_CLOTH_SETTINGS_VERSION 1u
/* Cloth parameters that can change while the scene runs. In a change, these values keep a parameter: NaN for
 * a float, 0 for solver and iterations, -1 for bend_constraints and assembled. cs_get_cloth_settings uses the
 * same values for parameters that are not known, or that the cloth or its solver does not have. A compliance
 * that was set cannot be set back to the server's default with cs_set_cloth. */
typedef struct cs_cloth_settings {
  uint32_t version CS_INIT(CS_CLOTH_SETTINGS_VERSION);
  float structural[2], shear[2], bend[2]; /* {stiffness in N/m, damping in N s/m} */
  float damping;                          /* 1/s */
  float drag, lift, friction;             /* coefficients */
  float thickness;                        /* m */
  uint32_t solver;                        /* cs_solver, or a newer kind */
  int32_t bend_constraints;               /* 0 or 1; constraint solvers */
  uint32_t iterations;                    /* all solvers except mass-spring */
  float tolerance;                        /* relative residual; constraint solvers and implicit Euler */
  float compliance;       /* m/N; constraint solvers and XPBD; read as NaN: server's default */
  float activation;       /* fraction of the rest length; CS_SOLVER_ACAD */
  int32_t assembled;      /* 1 if the solver multiplies assembled matrices, else 0; CS_SOLVER_CONSTRAINT */
  float dihedral_bending; /* N m */
  /* Self-collision: ball radius (m) and friction. Tethers: slack as a fraction of the length. They can be
   * changed only for cloths that were created with them, and are NaN for others. */
  float ball_radius, ball_friction, tether_slack;
  float pressure; /* Pa; of the gas inside; NaN for cloths that cannot hold gas */
} cs_cloth_settings;

/* Fails before the description. */
int cs_get_environment(const cs_client* client, cs_environment* out) CS_NOEXCEPT;
/* Fails if the cloth index is out of range or `out->version` is unknown. */
int cs_get_cloth_settings(const cs_client* client, uint32_t index, cs_cloth_settings* out) CS_NOEXCEPT;
/* Number of materials that the server offers; 0 before the description. */
uint32_t cs_material_count(const cs_client* client) CS_NOEXCEPT;
/* Name of a material; "" if the index is out of range. */
const char* cs_material(const cs_client* client, uint32_t index) CS_NOEXCEPT;
/* Material that was last applied to a cloth; "" if none was applied. */
const char* cs_cloth_material(const cs_client* client, uint32_t cloth) CS_NOEXCEPT;
/* Participant who made the newest change of parameters; 0 for the server. */
uint64_t cs_parameters_participant(const cs_client* client) CS_NOEXCEPT;

/* Changes gravity (m/s^2), wind (m/s) and air density (kg/m^3). Each pointer may be NULL. */
void cs_set_environment(cs_client* client, const float* gravity3, const float* wind3,
                        const float* air_density) CS_NOEXCEPT;
/* Changes the gusts; see cs_environment for the units. */
void cs_set_gust(cs_client* client, float strength, float seconds) CS_NOEXCEPT;
/* Fills in settings that change nothing, as the start of a change. Sets the version. */
void cs_keep_cloth_settings(cs_cloth_settings* out) CS_NOEXCEPT;
/* Changes the settings of a cloth. A new kind of solver gets the settings that it last had in this scene,
 * else the defaults of scene.proto. Fails before the description, for an unknown version and for an unknown
 * cloth. */
int cs_set_cloth(cs_client* client, const char* cloth, const cs_cloth_settings* settings) CS_NOEXCEPT;
/* Applies a material (see cs_material) to a cloth: springs, damping, drag, lift, friction, mass and
 * solver (XPBD; a cloth with implicit Euler keeps it). */
void cs_set_material(cs_client* client, const char* cloth, const char* material) CS_NOEXCEPT;
/* Changes the mass per area of a cloth: 0.0001 to 1000 kg/m^2. */
void cs_set_areal_mass(cs_client* client, const char* cloth, float areal_mass) CS_NOEXCEPT;

#define CS_COLLIDER_CHANGE_VERSION 1u
/* Change of a collider of the scene. NaN as the first number of a member keeps the member. The server refuses
 * numbers that the shape does not have. */
typedef struct cs_collider_change {
  uint32_t version CS_INIT(CS_COLLIDER_CHANGE_VERSION);
  float position[3];    /* m */
  float orientation[4]; /* quaternion x y z w */
  float radius;         /* m; sphere or capsule */
  float length;         /* m; capsule */
  float size[3];        /* m; box */
  float friction;       /* 0 or more */
} cs_collider_change;
/* Fills in a change that changes nothing. Sets the version. */
void cs_keep_collider(cs_collider_change* out) CS_NOEXCEPT;
/* Changes a collider of the scene. Fails if the version is unknown. */
int cs_set_collider(cs_client* client, const char* collider, const cs_collider_change* change) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Participants: people in the scene, and their roles.
 */

#define CS_PARTICIPANT_VERSION 1u
typedef struct cs_participant {
  uint32_t version CS_INIT(CS_PARTICIPANT_VERSION);
  uint64_t id;
  const char* name;        /* may be "" */
  const char* client_name; /* may be "" */
  uint32_t role;           /* cs_role, or a newer role */
  int32_t away;            /* 1 if the connection is lost and the server waits for a reconnect, else 0 */
} cs_participant;

/* PresenceKind of session.proto. */
typedef enum cs_presence_kind {
  CS_PRESENCE_JOINED = 1,
  CS_PRESENCE_LEFT = 2,
  CS_PRESENCE_ROLE_CHANGED = 3,
  CS_PRESENCE_DISCONNECTED = 4,
  CS_PRESENCE_RETURNED = 5,
  CS_PRESENCE_BODY_CHANGED = 6 /* the participant wears another body, or none */
} cs_presence_kind;

/* LeaveReason of session.proto. */
typedef enum cs_leave_reason {
  CS_LEAVE_LEFT = 1,
  CS_LEAVE_TIMED_OUT = 2,
  CS_LEAVE_REMOVED = 3
} cs_leave_reason;

#define CS_PRESENCE_VERSION 1u
typedef struct cs_presence {
  uint32_t version CS_INIT(CS_PRESENCE_VERSION);
  uint32_t kind;   /* cs_presence_kind, or a newer kind */
  uint32_t reason; /* cs_leave_reason if the participant left, else 0 */
  uint64_t by;     /* participant who caused it; 0 for the participant itself or the server */
} cs_presence;

/* Id of this participant; 0 before Welcome. */
uint64_t cs_participant_id(const cs_client* client) CS_NOEXCEPT;
/* cs_role of this participant, or a newer role, as the server granted it. */
uint32_t cs_get_role(const cs_client* client) CS_NOEXCEPT;
/* Number of participants in the scene, this one included. */
uint32_t cs_participant_count(const cs_client* client) CS_NOEXCEPT;
/* Participants are in the order in which they joined. Fails if the index is out of range. */
int cs_get_participant(const cs_client* client, uint32_t index, cs_participant* out) CS_NOEXCEPT;
/* The change that the newest CS_EVENT_PRESENCE reported, and the participant's current state, or its last
 * state if it left. Fails before the first. participant may be NULL. */
int cs_get_presence(const cs_client* client, cs_presence* out, cs_participant* participant) CS_NOEXCEPT;
/* Requests for owners: change a participant's role, or remove a participant. On success all participants get
 * CS_EVENT_PRESENCE; on failure this client gets CS_EVENT_ERROR. */
void cs_set_role(cs_client* client, uint64_t participant_id, uint32_t role) CS_NOEXCEPT;
void cs_remove_participant(cs_client* client, uint64_t participant_id) CS_NOEXCEPT;
/* Like cs_remove_participant. The subject of the participant's token also stays out of the scene, until the
 * scene is deleted or an owner lifts the ban. Fails for a participant without a token. */
void cs_ban_participant(cs_client* client, uint64_t participant_id) CS_NOEXCEPT;

#define CS_PAIRING_CODE_VERSION 1u
/* Code by which others pair with the server. */
typedef struct cs_pairing_code {
  uint32_t version CS_INIT(CS_PAIRING_CODE_VERSION);
  const char* code; /* six digits */
  uint32_t role;    /* cs_role of those who use it */
  uint32_t valid_s; /* seconds, counted from the event */
} cs_pairing_code;

/* Requests a code; only for clients whose token has the role owner. role: CS_ROLE_UNSPECIFIED means
 * participant. CS_EVENT_PAIRING_CODE or CS_EVENT_ERROR follows. */
void cs_create_pairing_code(cs_client* client, uint32_t role) CS_NOEXCEPT;
/* The newest code. Fails before the first. */
int cs_get_pairing_code(const cs_client* client, cs_pairing_code* out) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Recording: control the clock of the scene, play recordings, and write the stream to a file.
 */

#define CS_PLAYBACK_VERSION 1u
/* State of a recording that the server plays. */
typedef struct cs_playback {
  uint32_t version CS_INIT(CS_PLAYBACK_VERSION);
  double length;        /* s */
  double position;      /* s from the start, at now_us */
  double speed;         /* 1 is real time; 0: as fast as the participants acknowledge frames */
  int32_t loop, paused; /* 0 or 1 */
} cs_playback;

/* Requests an early key frame, so that a file can start with it. Frames before it are decoded as usual. It
 * comes at least 16 frames after the key frame before it. */
void cs_request_key_frame(cs_client* client, uint64_t now_us) CS_NOEXCEPT;

/* Fails if the scene is not a recording, or its state is not known yet. */
int cs_get_playback(const cs_client* client, uint64_t now_us, cs_playback* out) CS_NOEXCEPT;

/* Returns 1 if the server plays the recording in lockstep: it sends the next frame when all participants have
 * acknowledged the last one. */
int cs_in_lockstep(const cs_client* client) CS_NOEXCEPT;
/* on: in lockstep, a frame is acknowledged by cs_acknowledge_seen instead of when it is decoded. A program
 * that does not look at each frame when it arrives then still sees all of them. Default 0. */
void cs_hold_acknowledgements(cs_client* client, int on) CS_NOEXCEPT;
/* The program has seen the newest frame. Does nothing if its acknowledgement is not held. */
void cs_acknowledge_seen(cs_client* client) CS_NOEXCEPT;

/* The functions below send requests that affect all participants. They do nothing before CS_STATE_JOINED. */

/* Pauses or resumes the clock of any scene. */
void cs_pause(cs_client* client, int paused) CS_NOEXCEPT;
/* Recordings only: continues at `seconds` from the start, 0 to the length. */
void cs_seek(cs_client* client, double seconds) CS_NOEXCEPT;
/* Recordings only: 0.1 to 8; 1 is real time. In lockstep also 0: as fast as the participants acknowledge. */
void cs_set_speed(cs_client* client, double speed) CS_NOEXCEPT;
/* Recordings only: whether playback starts again at the end. */
void cs_set_loop(cs_client* client, int loop) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Statistics: how the stream, the connection and the simulation perform.
 */

#define CS_STATISTICS_VERSION 1u
typedef struct cs_statistics {
  uint32_t version CS_INIT(CS_STATISTICS_VERSION);
  uint64_t tick;            /* tick of the newest decoded frame */
  uint64_t frames;          /* decoded frames */
  uint64_t key_frames;      /* decoded frames that are key frames */
  uint64_t dropped;         /* frames that never arrived, from gaps between ticks */
  uint64_t decode_errors;   /* packets that the decoder refused */
  uint64_t bytes;           /* bytes of received packets */
  uint64_t hash_mismatches; /* decoded frames whose hash differs from the server's */
  double frames_per_second; /* over the last second */
  double kbit_per_second;   /* over the last second */
  double bits_per_vertex;   /* packet bits per vertex and frame, over all frames */
  double round_trip_ms;     /* minimum of the last 16 pings */
  double clock_offset_us;   /* server's clock minus own clock, at now_us; 0 before the first pong */
  double decode_ms;         /* decoding time of the newest frame; 0 without a clock (cs_set_clock) */
} cs_statistics;

#define CS_STAGE_STATISTICS_VERSION 1u
/* Time that a frame spends in each stage. */
typedef struct cs_stage_statistics {
  uint32_t version CS_INIT(CS_STAGE_STATISTICS_VERSION);
  /* Play-out; 0 if it is off. */
  uint32_t frames_waiting; /* frames that arrived before their display time */
  uint64_t late_frames;    /* frames that arrived after their display time */
  /* Display time beyond the newest frame: with an extrapolated frame, and with a held frame. */
  double led_on_ms, held_ms;
  double delay_ms, wanted_delay_ms; /* current delay, and the delay it moves towards */
  /* Newest decoded frame; 0 before the first pong, except decode_ms. */
  double server_ms;      /* from the start of the tick to the complete packet, on the server */
  double network_ms;     /* from the complete packet to its arrival */
  double decode_ms;      /* as in cs_statistics */
  double displayable_ms; /* sum of these three */
} cs_stage_statistics;

#define CS_CLOTH_REPORT_VERSION 1u
/* Performance and state of a cloth's simulation (ClothReport in session.proto). The server sends it a few
 * times a second. */
typedef struct cs_cloth_report {
  uint32_t version CS_INIT(CS_CLOTH_REPORT_VERSION);
  uint32_t active_constraints, iterations;              /* of the last solve; 0 for the mass-spring solver */
  float residual;                                       /* of the last solve, relative to its start */
  float strain_max, strain_p99, strain_mean;            /* fraction of the rest length */
  float kinetic_energy, elastic_energy, gravity_energy; /* J */
  float penetration;                                    /* maximum depth in a collider, m */
  float device_ms;                                      /* device time of the scene's whole tick */
  uint64_t tick;                                        /* tick of these values */
} cs_cloth_report;

/* Fails if `out->version` is unknown. */
int cs_get_statistics(const cs_client* client, uint64_t now_us, cs_statistics* out) CS_NOEXCEPT;
/* Quality that the server sends now. It depends on cs_want and on the connection. Fails before the
 * description; then the quality is 0. */
int cs_get_quality(const cs_client* client, uint32_t* quality) CS_NOEXCEPT;
/* Time between the first and the newest decoded frame, on the caller's clock. */
double cs_stream_seconds(const cs_client* client) CS_NOEXCEPT;
/* Fails if `out->version` is unknown. */
int cs_get_stage_statistics(const cs_client* client, cs_stage_statistics* out) CS_NOEXCEPT;
/* Fails if the cloth index is out of range, `out->version` is unknown, or no report arrived yet. */
int cs_get_cloth_report(const cs_client* client, uint32_t index, cs_cloth_report* out) CS_NOEXCEPT;
/* Turns cs_constraint_ends on or off. Default: off. */
void cs_want_constraints(cs_client* client, int wants, uint64_t now_us) CS_NOEXCEPT;
/* Ends of the active constraints of a cloth with the solver ACAD in the newest report: two vertices for each
 * constraint, numbered from the cloth's first vertex. Sets `*count` to the number of constraints; returns
 * null if it is 0. A report names at most 16,384 constraints, while active_constraints counts all of them.
 * Valid until the next call that receives. */
const uint32_t* cs_constraint_ends(const cs_client* client, uint32_t index, uint32_t* count) CS_NOEXCEPT;

/* ---------------------------------------------------------------------------------------------------------------
 * Datagrams: frames and input by UDP, in addition to the stream of messages (docs/transport.md).
 *
 * The program has the datagrams: a data channel of WebRTC, or ICE, DTLS and a UDP socket. It offers them with
 * cs_offer_datagrams, and opens them as the answer says. From then on it passes to cs_datagrams
 *  - each datagram that arrives (cs_receive_datagram);
 *  - each message of the stream, before cs_receive (cs_hold_message);
 *  - each message of cs_next_outgoing, before it is sent (cs_send_in_datagram).
 * After each of these calls, and at cs_datagrams_due_at, it calls the three functions cs_next_... until they
 * return NULL. One cs_datagrams belongs to one connection of the stream and one pair of offer and answer. It
 * is not thread-safe, and independent of the cs_client, so it may be in another thread or module.
 */

#define CS_DATAGRAM_OFFER_VERSION 1u
/* Credentials by which the server recognises this client (DatagramOffer in session.proto). */
typedef struct cs_datagram_offer {
  uint32_t version CS_INIT(CS_DATAGRAM_OFFER_VERSION);
  const char* ufrag;       /* of ICE: 4 to 64 letters, digits, + and / (RFC 8839 section 5.4) */
  const char* password;    /* of ICE: 22 to 256 of these */
  uint8_t fingerprint[32]; /* SHA-256 of the client's certificate for DTLS */
  int32_t sctp; /* 1: the datagrams are those of a data channel (WebRTC); 0: those of DTLS itself */
} cs_datagram_offer;

#define CS_DATAGRAM_ANSWER_VERSION 1u
/* How to reach the server (DatagramAnswer in session.proto). */
typedef struct cs_datagram_answer {
  uint32_t version CS_INIT(CS_DATAGRAM_ANSWER_VERSION);
  uint32_t addresses;      /* number of them, 0 to 16; 0: the server opens no datagrams */
  uint32_t port;           /* UDP, 1 to 65535; this and the following are 0 and "" without addresses */
  const char* ufrag;       /* as in cs_datagram_offer */
  const char* password;    /* as in cs_datagram_offer */
  uint8_t fingerprint[32]; /* SHA-256 of the server's certificate for DTLS */
} cs_datagram_answer;

/* Offers datagrams on the present connection: the one of the last cs_connecting or, without that call, the
 * first one. The offer is sent right after Hello. A later offer replaces it, and ends the server's
 * association with it. Strings are copied. Fails, and changes nothing, for an unknown version, a member that
 * is not allowed, on a mirror, and while there is no connection. */
int cs_offer_datagrams(cs_client* client, const cs_datagram_offer* offer) CS_NOEXCEPT;
/* The answer to the newest offer. Fails before it, and if `out->version` is unknown. Strings are valid until
 * the next offer, CS_EVENT_DATAGRAMS or end of the connection. */
int cs_get_datagram_answer(const cs_client* client, cs_datagram_answer* out) CS_NOEXCEPT;
/* An address of the answer, the preferred one first: such as "192.0.2.1" or "2001:db8::1", at most 45
 * characters out of [0-9A-Fa-f:.]. It can be malformed otherwise. "" if the index is out of range. Valid as
 * long as the answer. */
const char* cs_datagram_address(const cs_client* client, uint32_t index) CS_NOEXCEPT;

#define CS_MAX_DATAGRAM_BYTES 1150u

typedef struct cs_datagrams cs_datagrams;

cs_datagrams* cs_create_datagrams(void) CS_NOEXCEPT;
/* NULL is allowed. */
void cs_destroy_datagrams(cs_datagrams* datagrams) CS_NOEXCEPT;
/* Takes the payload of a datagram of the server, of any bytes. */
void cs_receive_datagram(cs_datagrams* datagrams, const uint8_t* datagram, size_t bytes,
                         uint64_t now_us) CS_NOEXCEPT;
/* Takes a message of the stream. Returns 0 if the program must pass it to cs_receive now. Returns 1 if it
 * must not: a frame whose reference is under way in datagrams is kept, and an old frame is dropped. Frames
 * are kept for at most 150 ms, and at most 32 of them with 4 MiB. */
int cs_hold_message(cs_datagrams* datagrams, const uint8_t* message, size_t bytes,
                    uint64_t now_us) CS_NOEXCEPT;
/* Takes a message of cs_next_outgoing. Returns 1 if it travels in datagrams, 0 if the program must send it on
 * the stream: while no datagram has arrived for 500 ms, and all messages except poses, acknowledgements and
 * requests for key frames. Poses that move attachments or joints also go there, because each is sent once. */
int cs_send_in_datagram(cs_datagrams* datagrams, const uint8_t* message, size_t bytes,
                        uint64_t now_us) CS_NOEXCEPT;

/* Next message for cs_receive, and its size in *bytes; NULL if there is none. The pointers of this function
 * and the next two are valid until the next call with the same cs_datagrams. */
const uint8_t* cs_next_datagram_message(cs_datagrams* datagrams, uint64_t now_us, size_t* bytes) CS_NOEXCEPT;
/* Next datagram to send to the server, at most CS_MAX_DATAGRAM_BYTES; NULL if there is none. */
const uint8_t* cs_next_datagram(cs_datagrams* datagrams, uint64_t now_us, size_t* bytes) CS_NOEXCEPT;
/* Next message to send on the stream; NULL if there is none. The newest poses travel there too when none have
 * followed them for 100 ms, because datagrams can be lost. */
const uint8_t* cs_next_stream_message(cs_datagrams* datagrams, uint64_t now_us, size_t* bytes) CS_NOEXCEPT;
/* Time at which these functions may return something without a further call; UINT64_MAX if never. */
uint64_t cs_datagrams_due_at(const cs_datagrams* datagrams) CS_NOEXCEPT;
/* Sets the round-trip time of the link, for example round_trip_ms of cs_statistics. 100 ms until then. */
void cs_set_datagram_round_trip(cs_datagrams* datagrams, uint64_t microseconds) CS_NOEXCEPT;

#define CS_DATAGRAM_STATISTICS_VERSION 1u
/* Counts since cs_create_datagrams. */
typedef struct cs_datagram_statistics {
  uint32_t version CS_INIT(CS_DATAGRAM_STATISTICS_VERSION);
  int32_t in_use;           /* 1 if a datagram has arrived in the last 500 ms, else 0 */
  uint64_t packets;         /* datagrams with pieces of frames that arrived */
  uint64_t lost_packets;    /* datagrams that were sent before the newest of these and did not arrive */
  uint64_t parity_packets;  /* packets with parity */
  uint64_t frames;          /* frames that are complete */
  uint64_t repaired_frames; /* complete frames that needed parity or a request */
  uint64_t lost_frames;     /* frames that were given up */
  uint64_t requests;        /* requests for missing pieces */
  uint64_t held_frames;     /* frames of both ways that waited for their reference */
} cs_datagram_statistics;
/* Fails if `out->version` is unknown. */
int cs_get_datagram_statistics(const cs_datagrams* datagrams, uint64_t now_us,
                               cs_datagram_statistics* out) CS_NOEXCEPT;

/* NOLINTEND(modernize-use-using) */

#ifdef __cplusplus
}
#endif
#endif
