/* Where this robot is, and what is around it: for programs on the robot, told by its edge_agent.
 *
 * The agent must have been started with --api-socket PATH (or api.socket in its configuration). A program opens a
 * connection to that path, asks, and gets answers; nothing is changed at the agent, and no reader slows it down.
 *
 *   comap_robot *robot = comap_robot_new();
 *   if (comap_robot_connect(robot, "/run/comap-edge/api", 1000) != COMAP_ROBOT_OK)
 *     fprintf(stderr, "%s\n", comap_robot_error(robot));
 *   comap_robot_pose pose = {.size = sizeof pose};
 *   while (comap_robot_wait_pose(robot, &pose, 1000) >= COMAP_ROBOT_OK) ...
 *   comap_robot_free(robot);
 *
 * Units are metres, radians and nanoseconds. T_a_b takes points of frame b into frame a. Frames: `map`, of the joint
 * map, right-handed, in which nothing is known of up; `odom`, the robot's own, in which the camera never jumps; `cam`,
 * the camera: x right, y down, z ahead.
 *
 * Threads: a handle is used by one thread at a time; two handles know nothing of each other. A thread that waits for
 * poses and one that reads surfels each open their own.
 *
 * ABI: functions are never changed or taken away under one SONAME; comap_robot_pose grows at its end only and carries
 * its size; the other structs never change. */
#ifndef COMAP_ROBOT_H
#define COMAP_ROBOT_H

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__) && defined(COMAP_ROBOT_BUILD)
#define COMAP_ROBOT_EXPORT __attribute__((visibility("default")))
#else
#define COMAP_ROBOT_EXPORT
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* What functions return. Errors are negative; comap_robot_error then says what happened. */
enum {
  COMAP_ROBOT_OK = 0,
  COMAP_ROBOT_NOTHING = 1,      /* no pose, or none newer, in the time given; not an error */
  COMAP_ROBOT_UNCHANGED = 2,    /* the tiles are those of the snapshot that is known already; not an error */
  COMAP_ROBOT_WRONG_USE = -1,   /* an argument makes no sense */
  COMAP_ROBOT_UNREACHABLE = -2, /* no agent there, or it has gone; connect again later */
  COMAP_ROBOT_BAD_DATA = -3,    /* what answers is no agent that this library understands */
  COMAP_ROBOT_TOO_LARGE = -4,   /* the answer would be larger than allowed: ask for a smaller box */
  COMAP_ROBOT_NO_MEMORY = -5
};

/* How well the camera is tracked. */
enum {
  COMAP_ROBOT_TRACKING_OK = 0,
  COMAP_ROBOT_TRACKING_POOR = 1, /* the pose is at least in part a prediction */
  COMAP_ROBOT_TRACKING_LOST = 2  /* the pose is a prediction, and not to be acted on */
};

/* What is known of the place in the joint map. */
enum {
  COMAP_ROBOT_MAP_UNPLACED = 0,  /* the core has not said yet where the robot is: map is empty, `map` is `odom` */
  COMAP_ROBOT_MAP_PLACED = 1,    /* in `map` */
  COMAP_ROBOT_MAP_ASTRAY = 2,    /* the robot was lost and began anew: `map` is its new beginning, or empty */
  COMAP_ROBOT_MAP_RECOGNISED = 3 /* as astray, but it believes to have found itself; the core has not confirmed it */
};

typedef struct comap_robot comap_robot;                 /* a connection to an agent, or the want of one */
typedef struct comap_robot_surfels comap_robot_surfels; /* an answer: the surfels of one box at one time */

/* A rigid motion: unit quaternion and translation in metres. */
typedef struct {
  double x, y, z;
  double qx, qy, qz, qw;
} comap_robot_transform;

#define COMAP_ROBOT_MAP_ID_BYTES 128

/* What the agent believed after a frame or a message of the core. */
typedef struct {
  uint32_t size;          /* in: sizeof(comap_robot_pose), set by the caller */
  int32_t tracking;       /* COMAP_ROBOT_TRACKING_... */
  int32_t map_state;      /* COMAP_ROBOT_MAP_... */
  int32_t has_covariance; /* 1: covariance is known (map_state is PLACED) */
  uint64_t sequence;      /* grows with each change; begins anew with the agent */
  uint64_t snapshot;      /* the tiles that were held then: see comap_robot_surfels_snapshot; 0 before the first */
  int64_t stamp_ns;       /* of the frame, on the camera's clock */
  int64_t known_at_ns;    /* when the agent knew it, CLOCK_MONOTONIC of this machine */
  char map[COMAP_ROBOT_MAP_ID_BYTES];    /* name of the map, ends with 0; another name is another frame */
  comap_robot_transform T_map_cam;       /* smooth: free of jumps as long as the map is the same; to steer by */
  comap_robot_transform T_map_cam_exact; /* the best estimate; steps when the core corrects it */
  comap_robot_transform T_map_odom;      /* T_map_cam = T_map_odom T_odom_cam; smooth */
  comap_robot_transform T_map_odom_exact;
  comap_robot_transform T_odom_cam;
  /* Of T_map_cam_exact, for T_map_cam_exact exp(xi), xi = (translation, rotation); row by row, m^2, m rad, rad^2. */
  double covariance[36];
} comap_robot_pose;

/* A small disc of surface, in the frame of the map. */
typedef struct {
  float position_m[3];
  float normal[3]; /* unit, towards who saw it */
  float radius_m;
  uint8_t r, g, b;
  uint8_t confidence;   /* fused measurement weight; 255 stands for that or more */
  uint8_t contributors; /* bit per robot that has seen it, in the order in which the core met them */
  uint8_t reserved[3];  /* 0 */
} comap_robot_surfel;

/* A cube of the map, 0.5 m wide, of which there are surfels in the answer. */
typedef struct {
  int32_t x, y, z;       /* it begins at 0.5 m times these */
  uint32_t surfels;      /* how many, from first_surfel on */
  uint64_t first_surfel; /* index into comap_robot_surfels_data */
  uint64_t revision;     /* another one, another content */
} comap_robot_tile;

/* Axis-parallel, in the frame of the map; both ends belong to it. */
typedef struct {
  double min_m[3], max_m[3];
} comap_robot_box;

/* The library's version as "0.1.0". */
COMAP_ROBOT_EXPORT const char* comap_robot_version(void);

/* A handle without connection; NULL if there is no memory. */
COMAP_ROBOT_EXPORT comap_robot* comap_robot_new(void);
/* Closes the connection and frees the handle, not the answers that came through it. NULL is allowed. */
COMAP_ROBOT_EXPORT void comap_robot_free(comap_robot* robot);

/* Connects to the agent that listens at `path`; a connection that is there is closed first. Sequences and snapshots
 * begin anew with each start of an agent: if comap_robot_session has changed, go on from 0. OK, UNREACHABLE, BAD_DATA
 * or WRONG_USE. */
COMAP_ROBOT_EXPORT int comap_robot_connect(comap_robot* robot, const char* path, int timeout_ms);
/* 1 while there is a connection. One that failed in the middle of an answer is closed. */
COMAP_ROBOT_EXPORT int comap_robot_connected(const comap_robot* robot);
/* What the last call that returned an error says, as one sentence; "" before. Valid until the next call with `robot`.
 */
COMAP_ROBOT_EXPORT const char* comap_robot_error(const comap_robot* robot);
/* The robot's name and the number of the agent's start, which no other start of this robot has; "" and 0 if there has
 * been no connection. The name is valid until the next connect. */
COMAP_ROBOT_EXPORT const char* comap_robot_name(const comap_robot* robot);
COMAP_ROBOT_EXPORT uint64_t comap_robot_session(const comap_robot* robot);

/* The latest pose, at once. OK; NOTHING if no frame has been tracked yet, `pose` is then unchanged; or an error. */
COMAP_ROBOT_EXPORT int comap_robot_latest_pose(comap_robot* robot, comap_robot_pose* pose);
/* Waits until there is a pose whose sequence is above pose->sequence (0: any), at most `timeout_ms` (up to a minute at
 * a time). If several came meanwhile it is the latest. OK; NOTHING if none came, `pose` is then unchanged; or an error.
 */
COMAP_ROBOT_EXPORT int comap_robot_wait_pose(comap_robot* robot, comap_robot_pose* pose, int timeout_ms);

/* The surfels within `box` of the tiles that the robot holds now, all of one state of its cache: a change of the map
 * is in it as a whole or not at all. `known_snapshot`: of an answer for this same box from this session; UNCHANGED is
 * returned, and no answer, if the robot's tiles are still those of that snapshot; 0: always answer. `most_surfels`: if
 * the tiles that the box touches hold more, TOO_LARGE is returned; 0: 16 million, whose answer takes 0.6 GB and while
 * it comes up to three times that. OK: *surfels is the answer, which the caller frees; otherwise it is NULL. */
COMAP_ROBOT_EXPORT int comap_robot_read_surfels(comap_robot* robot, const comap_robot_box* box, uint64_t known_snapshot,
                                                uint64_t most_surfels, int timeout_ms, comap_robot_surfels** surfels);
/* The functions below only look at an answer; any number of threads may do so at once. */
COMAP_ROBOT_EXPORT uint64_t comap_robot_surfels_snapshot(const comap_robot_surfels* surfels); /* grows with changes */
COMAP_ROBOT_EXPORT const char* comap_robot_surfels_map(const comap_robot_surfels* surfels);   /* whose frame it is in */
COMAP_ROBOT_EXPORT uint64_t comap_robot_surfels_count(const comap_robot_surfels* surfels);
COMAP_ROBOT_EXPORT const comap_robot_surfel* comap_robot_surfels_data(const comap_robot_surfels* surfels);
COMAP_ROBOT_EXPORT uint64_t comap_robot_surfels_tile_count(const comap_robot_surfels* surfels);
COMAP_ROBOT_EXPORT const comap_robot_tile* comap_robot_surfels_tiles(const comap_robot_surfels* surfels);
COMAP_ROBOT_EXPORT void comap_robot_surfels_free(comap_robot_surfels* surfels); /* NULL is allowed */

#ifdef __cplusplus
}
#endif

#endif
