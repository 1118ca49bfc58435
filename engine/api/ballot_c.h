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
 *           where, found, expected, what to do; a kernel's compiler may have several lines. With wrong arguments it
 *           writes nothing to its outputs; if it fails later, or is interrupted, it may have written a part of the
 *           answers. ballot_scene_error() and the like return the text of the handle's last failed call;
 *           ballot_last_error() that of the calling thread. No C++ exception leaves the library.
 * Handles   A handle that was closed or never opened is refused with BALLOT_ERROR_CLOSED, and so is a handle of the
 *           parent in a forked child (BALLOT_ERROR_FORKED): open a device in each process. Such a child ends
 *           without exit handlers that were registered before. A scene, buffer, kernel or job keeps its device alive,
 *           so they may be closed in any order. Closing NULL does nothing.
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

/* What structs are made of. In C++ they begin with their size and with zeros by themselves, a text may be a
 * std::string, an array on a device a ballot::Array, and a function that is told of progress any that has a name:
 * bool(double), false ends the call. */
#ifdef __cplusplus
#define BALLOT_SIZE(T) size_t size = sizeof(T)
#define BALLOT_ZERO = {}
#define BALLOT_INIT(T) (T{}) /* a struct T with its size set and all other members zero */

/* A text that the caller keeps until the call returns. */
struct BallotText {
  BallotText() = default;
  BallotText(const char* given) : text(given) {}
  template <class Text, class = decltype(static_cast<const Text*>(nullptr)->c_str())>
  BallotText(const Text& given) : text(given.c_str()) {}
  template <class Text, class = decltype(static_cast<const Text*>(nullptr)->c_str())>
  BallotText(const Text&& given) = delete; /* it would not live */
  operator const char*() const { return text; }
  const char* text = nullptr;
};

/* An array on a device, of a call's results or masks, or of a mesh. */
struct BallotTarget {
  BallotTarget() = default;
  BallotTarget(struct BallotBuffer* given) : buffer(given) {}
  template <class Array, class = decltype(static_cast<Array*>(nullptr)->handle())>
  BallotTarget(Array& array) : buffer(array.handle()) {}
  operator struct BallotBuffer *() const { return buffer; }
  struct BallotBuffer* buffer = nullptr;
};

/* A function that is told the share that is done. Must not throw. */
struct BallotProgress {
  BallotProgress() = default;
  template <class Function, class = decltype(bool((*static_cast<Function*>(nullptr))(0.5)))>
  BallotProgress(Function& function)
      : call([](void* of, double done) { return int(!(*static_cast<Function*>(of))(done)); }),
        user(const_cast<void*>(static_cast<const void*>(&function))) {}
  BallotProgress(int (*function)(void* user, double done), void* given) : call(function), user(given) {}
  int (*call)(void* user, double done) = nullptr;
  void* user = nullptr;
};

extern "C" {
#else
#define BALLOT_SIZE(T) size_t size
#define BALLOT_ZERO
#define BALLOT_INIT(T) ((T){.size = sizeof(T)}) /* a struct T with its size set and all other members zero */

typedef const char* BallotText;            /* that the caller keeps until the call returns */
typedef struct BallotBuffer* BallotTarget; /* an array on a device, of results, masks or a mesh */

/* A function that is told the share that is done; NULL: none. Non-zero ends the call with BALLOT_ERROR_INTERRUPTED. */
typedef struct BallotProgress {
  int (*call)(void* user, double done); /* the function */
  void* user;                           /* given to it */
} BallotProgress;
#endif

typedef uint32_t BallotBool; /* 0 or 1 */

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
typedef struct BallotKernel BallotKernel; /* GLSL of the user that asks scenes */

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
  BALLOT_SIZE(BallotDeviceInfo);
  char name[256];         /* as Vulkan tells it */
  char driver[256];       /* "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)" */
  char refusal[512];      /* why Ballot cannot use it; "" if it can */
  BallotBool is_cpu;      /* 1: a CPU device, such as lavapipe */
  BallotBool usable;      /* 1: Ballot can use it */
  uint32_t subgroup_size; /* lanes */
  BallotBool exports;     /* 1: buffers can be shared with other interfaces (ballot_buffer_create) */
} BallotDeviceInfo;

/* Writes the devices of this machine, at most `room`, and their number to *count. `infos` may be NULL if room is 0.
 * infos[0].size must be set; the others follow. */
BALLOT_API BallotStatus ballot_devices(BallotDeviceInfo* infos, size_t room, size_t* count);

/* Which device, and how it is opened. */
typedef struct BallotDeviceOptions {
  BALLOT_SIZE(BallotDeviceOptions);
  BallotText name BALLOT_ZERO;     /* an index, part of a name, "gpu" or "cpu"; NULL: the best GPU, else a CPU device */
  BallotBool validate BALLOT_ZERO; /* 1: Vulkan validation with synchronization checks; slow, for tests */
  const struct BallotVulkan* vulkan BALLOT_ZERO; /* a program's own, with none of the above; NULL: Ballot opens one */
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

#include "ballot_c_answers.h" /* rays, points, and what is asked of them */
#include "ballot_c_points.h"  /* points and boxes */

/* ---- Arrays that stay on the device ----------------------------------------------------------------------------- */

/* What an array on a device holds. */
typedef enum BallotRecord {
  BALLOT_RECORD_RAY = 0,        /* BallotRay; dead here if t_max is infinite */
  BALLOT_RECORD_HIT = 1,        /* BallotHit */
  BALLOT_RECORD_POINT = 2,      /* BallotPoint */
  BALLOT_RECORD_NEAREST = 3,    /* BallotNearestPoint */
  BALLOT_RECORD_FLOAT32 = 4,    /* float; this and those below: columns of answers */
  BALLOT_RECORD_UINT32 = 5,     /* uint32_t */
  BALLOT_RECORD_FLOAT32X3 = 6,  /* 3 float, as BallotVertex: ballot_scene_set_vertex_buffer() */
  BALLOT_RECORD_FLOAT32X2 = 7,  /* 2 float */
  BALLOT_RECORD_UINT8 = 8,      /* uint8_t */
  BALLOT_RECORD_FLOAT32X12 = 9, /* 12 float, a 3 x 4 matrix row by row: ballot_scene_set_transform_buffer() */
  BALLOT_RECORD_INT64 = 10,     /* int64_t: offsets of ballot_list_buffers() */
  BALLOT_RECORD_FLOAT64 = 11,   /* double: sums of ballot_trace_buffers() */
  BALLOT_RECORD_FLOAT32X4 = 12  /* 4 float: colors, attributes */
} BallotRecord;

/* A vertex on the device, 12 bytes. */
typedef struct BallotVertex {
  float at[3]; /* x, y, z */
} BallotVertex;

/* Moves the vertices of a mesh as ballot_scene_set_vertices() does, by the first records of an array of vertices on the
 * scene's device. ballot_scene_commit() reads them there: trees follow without the host, which sees vertices only where
 * a tree lies on the host, a mesh of a scene with several trees has fewer than 65 536 triangles, or exact lists,
 * pictures, edits or ballot_scene_triangles() ask for them later. Keep what the array holds until then; before commit
 * wait for your own stream. The array may be destroyed before. A vertex that is not finite or beyond 1e12 makes the
 * commit fail, and is named. */
BALLOT_API BallotStatus ballot_scene_set_vertex_buffer(BallotScene* scene, uint32_t mesh, BallotBuffer* vertices);

/* Moves all instances as ballot_scene_set_transforms() does, in the order of their numbers, by the first records of an
 * array of matrices on the scene's device. On a GPU ballot_scene_commit() reads them there, if the scene has 1024
 * instances or more, of which none lies in one tree with others or has a group; else the host reads them. It sees them
 * later if exact mode, closest points, pictures or edits ask for them. The array is kept as by
 * ballot_scene_set_vertex_buffer().
 * Beside it no meshes or instances come, go, move otherwise or get masks: that is refused until the commit. */
BALLOT_API BallotStatus ballot_scene_set_transform_buffer(BallotScene* scene, BallotBuffer* transforms);
/* Sets the masks of all instances as ballot_scene_set_masks() does, and after it, by the first records of an array of
 * BALLOT_RECORD_UINT32 on the scene's device, in the order of their numbers. ballot_scene_commit() has the host read
 * them, 4 bytes an instance. Where none becomes 0 or was 0 that is all: no tree changes. The array is kept as by
 * ballot_scene_set_vertex_buffer(), and may stand beside ballot_scene_set_transform_buffer(). */
BALLOT_API BallotStatus ballot_scene_set_mask_buffer(BallotScene* scene, BallotBuffer* masks);

/* How an array on a device is made. */
typedef struct BallotBufferOptions {
  BALLOT_SIZE(BallotBufferOptions);
  BallotBool exported
      BALLOT_ZERO; /* 1: other interfaces can use the memory: ballot_buffer_fd(), ballot_buffer_cuda() */
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
/* Copies records from CUDA's memory on the same GPU, where they lie side by side, to [first, first + count) of an
 * exported buffer. The host sees none. Work of other streams that writes them must have ended. */
BALLOT_API BallotStatus ballot_buffer_write_cuda(BallotBuffer* buffer, uint64_t first, uint64_t address,
                                                 uint64_t count);
/* Returns the text of the array's last failed call. */
BALLOT_API const char* ballot_buffer_error(BallotBuffer* buffer);

/* A column of answers, and the array on the scene's device that it goes to: the first records of it. */
typedef struct BallotOutput {
  /* The name of a member of BallotHits or BallotNearest, as "t", or of an attribute. The array holds numbers of its
   * type: "uvs" go to BALLOT_RECORD_FLOAT32X2, "prim_sums" to BALLOT_RECORD_FLOAT64. "occluded", "front" and "inside"
   * go to BALLOT_RECORD_UINT8 or BALLOT_RECORD_UINT32. */
  BallotText column BALLOT_ZERO;
  BallotTarget to BALLOT_ZERO; /* each array once, and not what is asked */
} BallotOutput;

/* Traces rays [0, count) of an array and writes columns of their answers, with the bits that ballot_trace() writes.
 * Returns when they are written. BallotTimes::hits is not counted. query->progress may end the call, but is told no
 * share. With first, cull, alpha or masks hits are the first crossings, as by ballot_trace(), and outputs hold `first`
 * records of each ray, but for sums. The scene keeps 16 bytes a hit on the device unless "hits" are among the columns,
 * for "normals", "positions" and "front" 36 bytes a triangle, unless it is flat and was built there, and for columns of
 * surfaces what their shading takes: 48 a triangle, and more as it has textures, colours and normals. */
BALLOT_API BallotStatus ballot_trace_buffers(BallotScene* scene, BallotBuffer* rays, uint64_t count,
                                             const BallotOutput* outputs, size_t output_count, const BallotQuery* query,
                                             BallotTimes* times);

/* Without first, cull, alpha, masks and sums the same, but does not wait, so that one batch follows another without a
 * gap. Jobs run in their order. Two are on their way to the device at once; those behind them are sent together by a
 * later call, ballot_job_poll() or ballot_job_wait(). Keep scene and buffers until the job has ended. */
BALLOT_API BallotStatus ballot_submit_buffers(BallotScene* scene, BallotBuffer* rays, uint64_t count,
                                              const BallotOutput* outputs, size_t output_count,
                                              const BallotQuery* query, BallotJob** job);

/* A point on the device, 16 bytes. One with a component that is not finite, or a limit that is negative or NaN, is near
 * nothing, and outside. */
typedef struct BallotPoint {
  float at[3]; /* x, y, z */
  float limit; /* triangles farther away are not looked for; infinity: no limit */
} BallotPoint;

/* Answers points [0, count) of an array and writes columns of their answers. Answers and errors are those of
 * ballot_query_points(), but with a limit of each point; query->progress may end the call, but is told no share.
 * A GPU finds an order in which neighbours are near each other; on a CPU put such points next to each other, as they
 * share a subgroup. Only numeric "exact" brings points to the host. Returns when the answers are written.
 * BallotTimes::hits is not counted. The scene keeps 56 bytes for each of up to 4 million points. */
BALLOT_API BallotStatus ballot_query_point_buffers(BallotScene* scene, BallotBuffer* points, uint64_t count,
                                                   const BallotOutput* outputs, size_t output_count,
                                                   const BallotQuery* query, BallotTimes* times);

/* Where lists go, on the scene's device. */
typedef struct BallotListBuffers {
  BALLOT_SIZE(BallotListBuffers);
  BallotTarget counts BALLOT_ZERO;  /* BALLOT_RECORD_UINT32: of each question how many are listed; NULL: not wanted */
  BallotTarget offsets BALLOT_ZERO; /* BALLOT_RECORD_INT64, one more than questions: as in BallotLists; NULL */
  BallotTarget hits BALLOT_ZERO;    /* BALLOT_RECORD_HIT: the lists, one after the other; NULL: they are only counted */
} BallotListBuffers;

/* Lists the crossings of rays [0, count) of an array, or the triangles within the limits of points, as the array has
 * them, with the bits of ballot_list_crossings() and ballot_list_within(). Writes the number of all to *total, which
 * may be NULL. If hits has fewer records, that is BALLOT_ERROR_ARGUMENT: counts, offsets and *total are written, the
 * hits unspecified. So call twice, first without hits; or make room for what there is at most. The host sees *total
 * alone, but for numeric "exact", lists of more than 16384, and devices that are the CPU. Neighbours share a
 * subgroup, so put questions that are alike next to each other. query and times as of ballot_trace_buffers(). */
BALLOT_API BallotStatus ballot_list_buffers(BallotScene* scene, BallotBuffer* questions, uint64_t count,
                                            const BallotListBuffers* lists, const BallotQuery* query, uint64_t* total,
                                            BallotTimes* times);

/* Writes those of the first `count` hits of an array that are no misses to `alone`, one after the other, and the number
 * of the ray of each to `rays` (BALLOT_RECORD_UINT32); a ray has `first` hits, as BallotQuery::first was; 0: one. Both
 * have room for `count` records. Writes their number to *found. */
BALLOT_API BallotStatus ballot_compact_hits(BallotScene* scene, BallotBuffer* hits, uint64_t count, uint32_t first,
                                            BallotBuffer* alone, BallotBuffer* rays, uint64_t* found);

/* ---- Rays and pictures of a view -------------------------------------------------------------------------------- */

/* A camera, as in glTF: it looks along -z of its frame, with +y up. */
typedef struct BallotView {
  BALLOT_SIZE(BallotView);
  BallotText name
      BALLOT_ZERO; /* a view of the scene; NULL: the members below, or if eye equals target the scene's first view */
  double eye[3] BALLOT_ZERO;    /* x, y, z: where it is */
  double target[3] BALLOT_ZERO; /* what it looks at */
  double up[3] BALLOT_ZERO;     /* what is up; zero: +y */
  double yfov BALLOT_ZERO;      /* full vertical angle, radians, 0 to pi; 0: pi / 3 */
  double ymag BALLOT_ZERO;      /* above 0: orthographic, half the height of the view */
} BallotView;

/* Makes the rays of a ray kind (`ballot methods` lists them: "primary", "shadow", "ao", ...) for a view of width x
 * height pixels: at most `room` rays. Writes their number to *count; room 0 asks for the number alone. Scenes with an
 * origin (BallotSceneInfo::origin) are refused: take the next one. */
BALLOT_API BallotStatus ballot_make_rays(BallotScene* scene, const BallotView* view, const char* kind, uint32_t width,
                                         uint32_t height, BallotRay* rays, size_t room, size_t* count);
/* The same of any scene, in double, each a row of eight: origin, t_min, direction, t_max. They were made in float32
 * about the scene's origin, which is added: of its distance from zero that is off by 2^-53. */
BALLOT_API BallotStatus ballot_make_rays_double(BallotScene* scene, const BallotView* view, const char* kind,
                                                uint32_t width, uint32_t height, double* rays, size_t room,
                                                size_t* count);

/* What is rendered, and where it goes. */
typedef struct BallotPicture {
  BALLOT_SIZE(BallotPicture);
  uint32_t width BALLOT_ZERO;     /* pixels, 1 to 16384; 0: 512 */
  uint32_t height BALLOT_ZERO;    /* as width */
  uint32_t samples BALLOT_ZERO;   /* of each pixel, 1 to 65536; 0: 1 */
  BallotText shading BALLOT_ZERO; /* "eyelight", "normals", "ao", "whitted", "path"; NULL: "eyelight" */
  float* rgba BALLOT_ZERO;        /* width * height * 4 floats, linear Rec.709 and coverage, rows from the top */
  BallotText sky
      BALLOT_ZERO; /* as `ballot render --sky` takes it: "none", "gradient", "r,g,b", FILE.exr; NULL: the scene's own */
  int32_t bounces BALLOT_ZERO; /* last path depth, 1 to 64; 0: the shading's own */
  uint32_t seed BALLOT_ZERO;   /* of the random numbers */
} BallotPicture;

/* Renders a view. view, query and times may be NULL. */
BALLOT_API BallotStatus ballot_render(BallotScene* scene, const BallotView* view, const BallotPicture* picture,
                                      const BallotQuery* query, BallotTimes* times);

#include "ballot_c_kernels.h" /* kernels of the user */

#include "ballot_c_vulkan.h" /* programs with Vulkan of their own */

#ifdef __cplusplus
}
#endif
#endif
