/* The C interface of Ballot: fast, correct ray queries by Vulkan compute, on any Vulkan 1.2 device. This header needs
 * the C standard library alone. The C++ interface, ballot/ballot.h, is a thin layer over it.
 *
 *   BallotDevice* device; BallotScene* scene;
 *   ballot_device_open(NULL, &device);                         // the best GPU, else a CPU device
 *   BallotMesh mesh = BALLOT_INIT(BallotMesh);
 *   mesh.positions = vertices; mesh.vertex_count = 8;          // float x, y, z
 *   mesh.indices = triangles; mesh.index_count = 36; mesh.index_type = BALLOT_INDEX_U32;
 *   ballot_scene_create(device, &mesh, 1, NULL, NULL, &scene);
 *   BallotRays rays = ballot_rays(my_rays, n);                 // float ox oy oz t_min dx dy dz t_max
 *   BallotHits out = BALLOT_INIT(BallotHits);
 *   out.hits = my_hits;                                        // room for n
 *   if (ballot_trace(scene, &rays, &out, NULL, NULL)) fprintf(stderr, "%s\n", ballot_scene_error(scene));
 *   ballot_scene_destroy(scene); ballot_device_close(device);
 *
 * Structs   Their first member is the size that the caller was compiled with. BALLOT_INIT sets it and zeroes the rest;
 *           zero is every member's default. Later versions add members at the end alone.
 * Errors    A function that can fail returns BALLOT_OK (0) or an error code, and keeps a text of one line then: what,
 *           where, found, expected, what to do. With wrong arguments it writes nothing to its outputs; if it fails
 *           later, or is interrupted, it may have written a part of the answers. ballot_device_error(),
 *           ballot_scene_error() and ballot_buffer_error() return the text of the handle's last failed call;
 *           ballot_last_error() that of the calling thread. No C++ exception leaves the library.
 * Handles   A handle that was closed or never opened is refused with BALLOT_ERROR_CLOSED, and so is a handle of the
 *           parent in a forked child (BALLOT_ERROR_FORKED): open a device in each process. A scene, buffer or job keeps
 *           its device alive, so they may be closed in any order. Closing NULL does nothing.
 * Threads   Every function may be called from any thread. Calls on one device, its scenes and its buffers run one after
 *           another. Devices are independent of each other: give each thread a device of its own to trace at once.
 * Callbacks Functions that a call is given, as BallotQuery::progress, must not call the device that the call is on:
 *           BALLOT_ERROR_WORK. What they destroy goes once the call has ended.
 * Units     Lengths are in scene units, angles in radians. t counts multiples of a ray's direction.
 */
#ifndef BALLOT_C_H
#define BALLOT_C_H

#include <stddef.h>
#include <stdint.h>

#define BALLOT_VERSION_MAJOR 1 /* the version of this header: programs have to be changed */
#define BALLOT_VERSION_MINOR 0 /* something was added */
#define BALLOT_VERSION_PATCH 0 /* faults were mended */

#if defined(_WIN32)
#define BALLOT_API
#else
#define BALLOT_API __attribute__((visibility("default"))) /* what the library exports */
#endif

#ifdef __cplusplus
#define BALLOT_INIT(T) ballot_init<T>() /* a struct T with its size set and all other members zero */
/* What BALLOT_INIT is in C++. */
template <class T>
inline T ballot_init() {
  T t{};
  t.size = sizeof(T);
  return t;
}
extern "C" {
#else
#define BALLOT_INIT(T) ((T){.size = sizeof(T)}) /* a struct T with its size set and all other members zero */
#endif

/* What functions return: 0, or why they failed. */
typedef enum BallotStatus {
  BALLOT_OK = 0,
  BALLOT_ERROR_WORK = 1,        /* a file, the driver or the device failed */
  BALLOT_ERROR_ARGUMENT = 2,    /* an argument is out of range, or arguments disagree */
  BALLOT_ERROR_DEVICE = 3,      /* there is no usable Vulkan device */
  BALLOT_ERROR_MEMORY = 4,      /* the host ran out of memory */
  BALLOT_ERROR_CLOSED = 5,      /* the handle is closed, or none */
  BALLOT_ERROR_FORKED = 6,      /* the handle was opened before fork() */
  BALLOT_ERROR_INTERRUPTED = 7, /* the progress callback asked to stop */
  BALLOT_NOT_READY = 8          /* of ballot_job_poll() alone: the job still runs */
} BallotStatus;

typedef struct BallotDevice BallotDevice; /* a device that is open */
typedef struct BallotScene BallotScene;   /* a scene on a device */
typedef struct BallotBuffer BallotBuffer; /* an array on a device */
typedef struct BallotJob BallotJob;       /* a trace in the background */

/* Returns the version of the library that is loaded, such as "1.0.0". The first number changes when programs have to be
 * changed. */
BALLOT_API const char* ballot_version(void);
/* Returns the commit that it was built from, or "unknown". */
BALLOT_API const char* ballot_commit(void);
/* The arguments whose names ballot_name() lists. */
typedef enum BallotNames {
  BALLOT_NAMES_METHODS = 0,   /* BallotQuery.method */
  BALLOT_NAMES_NUMERIC = 1,   /* BallotQuery.numeric */
  BALLOT_NAMES_BUILDERS = 2,  /* BallotSceneOptions.builder */
  BALLOT_NAMES_RAY_KINDS = 3, /* ballot_make_rays() */
  BALLOT_NAMES_SHADINGS = 4   /* BallotPicture.shading */
} BallotNames;
/* Returns name number `index` of those that an argument takes; NULL behind the last one. */
BALLOT_API const char* ballot_name(BallotNames names, size_t index);
/* Returns the text of the calling thread's last failed call; "" if none failed. Valid until its next failed call. */
BALLOT_API const char* ballot_last_error(void);

/* ---- Devices ---------------------------------------------------------------------------------------------------- */

/* What a device is, and whether Ballot can use it. */
typedef struct BallotDeviceInfo {
  size_t size;
  char name[256];         /* as Vulkan tells it */
  char driver[256];       /* "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)" */
  char refusal[512];      /* why Ballot cannot use it; "" if it can */
  uint32_t is_cpu;        /* 1: a CPU device, such as lavapipe */
  uint32_t usable;        /* 1: Ballot can use it */
  uint32_t subgroup_size; /* lanes */
  uint32_t exports;       /* 1: buffers can be shared with other interfaces (ballot_buffer_create) */
} BallotDeviceInfo;

/* Writes the devices of this machine, at most `room`, and their number to *count. `infos` may be NULL if room is 0.
 * infos[0].size must be set; the others follow. */
BALLOT_API BallotStatus ballot_devices(BallotDeviceInfo* infos, size_t room, size_t* count);

/* Which device, and how it is opened. */
typedef struct BallotDeviceOptions {
  size_t size;
  const char* name;  /* an index, part of a name, "gpu" or "cpu"; NULL: the best GPU, else a CPU device */
  uint32_t validate; /* 1: Vulkan validation with synchronization checks; slow, for tests */
} BallotDeviceOptions;

/* Opens a device. options may be NULL. */
BALLOT_API BallotStatus ballot_device_open(const BallotDeviceOptions* options, BallotDevice** device);
/* Closes a device. What was made on it keeps it open until that is destroyed. */
BALLOT_API void ballot_device_close(BallotDevice* device);
/* Tells of an open device. info->size must be set. */
BALLOT_API BallotStatus ballot_device_info(BallotDevice* device, BallotDeviceInfo* info);
/* Returns the number of messages of the validation layers so far, or 0. */
BALLOT_API size_t ballot_device_message_count(BallotDevice* device);
/* Returns the text of the device's last failed call. */
BALLOT_API const char* ballot_device_error(BallotDevice* device);

#include "ballot_c_scenes.h" /* meshes, instances, updates */

/* ---- Rays, hits, queries ---------------------------------------------------------------------------------------- */

/* A ray: hits are sought at origin + t * dir with t in [t_min, t_max]. dir need not be of unit length. A ray is dead,
 * and reported as a miss, if t_max <= t_min, if a component is NaN or infinite, or if dir is zero or denormal: if no
 * component of it reaches 2^-126, about 1.18e-38, in any mode. Modes other than "exact" promise nothing for a ray that
 * starts farther from the scene than 2^20 diagonals of its bounds. Mode "watertight" places each vertex as float32 sees
 * it from the origin, off by up to about 2^-22 of the distance: from afar a closed mesh stays closed, but may lie
 * elsewhere as a whole. */
typedef struct BallotRay {
  float origin[3]; /* x, y, z */
  float t_min;     /* hits before it do not count */
  float dir[3];    /* x, y, z */
  float t_max;     /* nor do those behind it; infinity: no end */
} BallotRay;

/* A hit. On a miss prim is BALLOT_MISS, t infinity, u = v = 0. u and v weigh vertices 1 and 2 of the triangle. */
typedef struct BallotHit {
  float t;       /* distance, in multiples of dir */
  uint32_t prim; /* the triangle, counted through the instances of the scene */
  float u, v;    /* barycentric coordinates, 0 to 1 */
} BallotHit;
#define BALLOT_MISS 0xFFFFFFFFu /* the number of no triangle, mesh or instance */

enum { BALLOT_FLOAT32 = 0, BALLOT_FLOAT64 = 1 };
#define BALLOT_AXES 8 /* the most axes of a shape */

/* One number, or three, of each question, as they lie in the caller's memory, at any address. float64 is rounded to the
 * nearest float32, beyond its range to infinity. Numbers that stand for all questions are read before the call returns,
 * also by ballot_submit(). */
typedef struct BallotColumn {
  const void* data;              /* of the first question; NULL: the column's default */
  ptrdiff_t stride[BALLOT_AXES]; /* bytes from one question to the next along each axis of the shape; 0: one for all */
  uint32_t type;                 /* BALLOT_FLOAT32 or BALLOT_FLOAT64 */
  ptrdiff_t gap;                 /* bytes between a number and the next of its three; 0: they lie side by side */
} BallotColumn;

/* Rays. {n} is the shape of n rays, {h, w} that of h rows of w, whose neighbours in the last axis are neighbours in the
 * results. */
typedef struct BallotRays {
  size_t size;
  size_t shape[BALLOT_AXES];      /* a zero behind the first number, and what follows, is no axis */
  BallotColumn origin, direction; /* x, y, z each */
  BallotColumn t_min, t_max;      /* NULL: 0, and no end */
} BallotRays;

/* Returns rays that lie as records. */
static inline BallotRays ballot_rays(const BallotRay* records, size_t count) {
  BallotRays rays = BALLOT_INIT(BallotRays);
  rays.shape[0] = count;
  if (!records) return rays;
  rays.origin.data = records->origin, rays.direction.data = records->dir;
  rays.t_min.data = &records->t_min, rays.t_max.data = &records->t_max;
  rays.origin.stride[0] = rays.direction.stride[0] = (ptrdiff_t)sizeof(BallotRay);
  rays.t_min.stride[0] = rays.t_max.stride[0] = (ptrdiff_t)sizeof(BallotRay);
  return rays;
}
/* Returns rays that lie as rows of six floats: origin, direction. */
static inline BallotRays ballot_rays_of_six(const float* rows, size_t count) {
  BallotRays rays = BALLOT_INIT(BallotRays);
  rays.shape[0] = count;
  if (!rows) return rays;
  rays.origin.data = rows, rays.direction.data = rows + 3;
  rays.origin.stride[0] = rays.direction.stride[0] = (ptrdiff_t)(6 * sizeof(float));
  return rays;
}

/* Where the results go: arrays of an entry for each ray, in their order. Those that are NULL are not written. The
 * arrays must not overlap the rays or each other. */
typedef struct BallotHits {
  size_t size;
  BallotHit* hits;     /* whole hits */
  float* t;            /* distance; on a miss infinity */
  uint32_t* prims;     /* number of the triangle within its mesh; on a miss BALLOT_MISS */
  uint32_t* mesh_ids;  /* BallotMesh::id, or as BallotSceneOptions::ids says; on a miss BALLOT_MISS */
  float* uvs;          /* u, v: two floats; on a miss 0 */
  float* normals;      /* x, y, z: unit normal of the triangle, by the right-hand rule over its vertices; on a miss 0 */
  uint8_t* occluded;   /* 1: hit, 0: miss */
  uint32_t* instances; /* number of the instance; 0 in scenes without instances; on a miss BALLOT_MISS */
} BallotHits;

/* A setting of a method, as `ballot methods` lists them: "vote", "count". */
typedef struct BallotKnob {
  const char *name, *value; /* both as text */
} BallotKnob;

/* How to find hits. The default finds the nearest, watertight, by the method that is fastest here. */
typedef struct BallotQuery {
  size_t size;
  uint32_t any;            /* 0: the nearest hit; 1: some hit, for visibility and shadows */
  const char* method;      /* `ballot methods` lists them; NULL: "auto" */
  const char* numeric;     /* "watertight", "exact", "plain" or "fast"; NULL: "watertight" */
  const BallotKnob* knobs; /* settings of the method; NULL: its defaults */
  size_t knob_count;       /* number of knobs */
  const char*
      ray_class; /* for method auto: primary, shadow, ao, diffuse, coherent or the like; NULL: it looks at the rays */
  /* Called now and then with the share that is done, from the thread that traces; also before the call waits for
   * another one, or for work that does not stop. Returning non-zero ends the call with BALLOT_ERROR_INTERRUPTED; what
   * is written to the outputs by then is unspecified. */
  int (*progress)(void* user, double done);
  void* user; /* given to progress */
} BallotQuery;

/* What a call took. */
typedef struct BallotTimes {
  size_t size;
  double seconds;   /* wall time of the call */
  double device_ms; /* time of the traversal on the device */
  uint64_t hits;    /* rays that hit */
} BallotTimes;

/* Traces rays, nearest or any hits, and returns when the results are written. Neighbours in the array share a subgroup:
 * order rays for coherence. Rays in rows, as of a camera or a turning scanner, are traced in tiles of 8 x 8. query and
 * times may be NULL. Zero rays are allowed. */
BALLOT_API BallotStatus ballot_trace(BallotScene* scene, const BallotRays* rays, const BallotHits* hits,
                                     const BallotQuery* query, BallotTimes* times);

/* The same in the background. Rays and arrays must stay as they are until the job has ended; the structs are copied.
 * Jobs of a device run in the order in which they were submitted. A scene that is updated before a job has ended may
 * answer it as before or after the update: wait first. */
BALLOT_API BallotStatus ballot_submit(BallotScene* scene, const BallotRays* rays, const BallotHits* hits,
                                      const BallotQuery* query, BallotJob** job);
/* Waits for the job and returns its status. times may be NULL. */
BALLOT_API BallotStatus ballot_job_wait(BallotJob* job, BallotTimes* times);
/* Returns BALLOT_NOT_READY, or the status of the job that has ended. */
BALLOT_API BallotStatus ballot_job_poll(BallotJob* job);
/* Waits for the job and frees it; in a callback it waits once the call has ended, but for a callback of a job. */
BALLOT_API void ballot_job_destroy(BallotJob* job);

/* ---- Arrays that stay on the device ----------------------------------------------------------------------------- */

/* What an array on a device holds. */
typedef enum BallotRecord {
  BALLOT_RECORD_RAY = 0,             /* BallotRay */
  BALLOT_RECORD_HIT = 1,             /* BallotHit */
  BALLOT_RECORD_POINT = 2,           /* BallotPoint; this and those below: ballot_query_point_buffers() */
  BALLOT_RECORD_NEAREST = 3,         /* BallotNearestPoint */
  BALLOT_RECORD_SIGNED_DISTANCE = 4, /* float */
  BALLOT_RECORD_INSIDE = 5           /* uint32_t */
} BallotRecord;

/* How an array on a device is made. */
typedef struct BallotBufferOptions {
  size_t size;
  uint32_t exported; /* 1: other interfaces can use the memory: ballot_buffer_fd(), ballot_buffer_cuda() */
} BallotBufferOptions;

/* Makes an array of records on a device. options may be NULL. */
BALLOT_API BallotStatus ballot_buffer_create(BallotDevice* device, BallotRecord record, uint64_t count,
                                             const BallotBufferOptions* options, BallotBuffer** buffer);
/* Destroys an array. */
BALLOT_API void ballot_buffer_destroy(BallotBuffer* buffer);
/* Copies records from the host to [first, first + count). */
BALLOT_API BallotStatus ballot_buffer_write(BallotBuffer* buffer, uint64_t first, const void* records, uint64_t count);
/* Copies records [first, first + count) to the host. */
BALLOT_API BallotStatus ballot_buffer_read(BallotBuffer* buffer, uint64_t first, void* records, uint64_t count);
/* Returns the buffer's memory in the host's address space, on devices that share it (CPU devices); else NULL. */
BALLOT_API void* ballot_buffer_host(BallotBuffer* buffer);
/* Writes a new file descriptor of an exported buffer's memory (VK_KHR_external_memory_fd, opaque), which the caller
 * owns, and the size of the allocation. */
BALLOT_API BallotStatus ballot_buffer_fd(BallotBuffer* buffer, int* fd, uint64_t* allocation_bytes);
/* Writes the address of an exported buffer in CUDA's primary context of the same GPU, valid until the buffer is
 * destroyed. Needs libcuda.so.1. Calls of this library wait for the device before they return; before a call that uses
 * the buffer, wait for your own stream. */
BALLOT_API BallotStatus ballot_buffer_cuda(BallotBuffer* buffer, uint64_t* address, int* cuda_device);
/* Returns the text of the array's last failed call. */
BALLOT_API const char* ballot_buffer_error(BallotBuffer* buffer);

/* Traces rays [0, count) of one array and writes their hits to another; both of the scene's device. Returns when the
 * hits are written. BallotTimes::hits is not counted. query->progress may end the call, but is told no share. */
BALLOT_API BallotStatus ballot_trace_buffers(BallotScene* scene, BallotBuffer* rays, BallotBuffer* hits, uint64_t count,
                                             const BallotQuery* query, BallotTimes* times);

/* The same, but does not wait, so that one batch follows another without a gap. Jobs run in their order. Two are on
 * their way to the device at once; those behind them are sent together by a later call, ballot_job_poll() or
 * ballot_job_wait(). Keep scene and buffers until the job has ended. */
BALLOT_API BallotStatus ballot_submit_buffers(BallotScene* scene, BallotBuffer* rays, BallotBuffer* hits,
                                              uint64_t count, const BallotQuery* query, BallotJob** job);

/* ---- Rays and pictures of a view -------------------------------------------------------------------------------- */

/* A camera, as in glTF: it looks along -z of its frame, with +y up. */
typedef struct BallotView {
  size_t size;
  const char* name; /* a view of the scene; NULL: the members below, or if eye equals target the scene's first view */
  double eye[3], target[3], up[3]; /* x, y, z each: where it is, what it looks at, what is up; up zero: +y */
  double yfov;                     /* full vertical angle, radians, 0 to pi; 0: pi / 3 */
  double ymag;                     /* above 0: orthographic, half the height of the view */
} BallotView;

/* Makes the rays of a ray kind (`ballot methods` lists them: "primary", "shadow", "ao", ...) for a view of width x
 * height pixels: at most `room` rays. Writes their number to *count; room 0 asks for the number alone. */
BALLOT_API BallotStatus ballot_make_rays(BallotScene* scene, const BallotView* view, const char* kind, uint32_t width,
                                         uint32_t height, BallotRay* rays, size_t room, size_t* count);

/* What is rendered, and where it goes. */
typedef struct BallotPicture {
  size_t size;
  uint32_t width, height; /* pixels, 1 to 16384 */
  uint32_t samples;       /* of each pixel, 1 to 65536; 0: 1 */
  const char* shading;    /* "eyelight", "normals", "ao", "whitted", "path"; NULL: "eyelight" */
  float* rgba;            /* width * height * 4 floats, linear Rec.709 and coverage, rows from the top */
  const char* sky; /* as `ballot render --sky` takes it: "none", "gradient", "r,g,b", FILE.exr; NULL: the scene's own */
  int32_t bounces; /* last path depth, 1 to 64; 0: the shading's own */
  uint32_t seed;   /* of the random numbers */
} BallotPicture;

/* Renders a view. view, query and times may be NULL. */
BALLOT_API BallotStatus ballot_render(BallotScene* scene, const BallotView* view, const BallotPicture* picture,
                                      const BallotQuery* query, BallotTimes* times);

#include "ballot_c_points.h" /* points and crossings */

#ifdef __cplusplus
}
#endif
#endif
