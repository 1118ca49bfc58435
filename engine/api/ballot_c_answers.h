/* Questions and answers: rays and points, where they lie, what is asked of them, where the answers go. ballot_c.h
 * includes it. */
#ifndef BALLOT_C_ANSWERS_H
#define BALLOT_C_ANSWERS_H

#ifndef BALLOT_C_H
#error include ballot/ballot_c.h
#endif

/* ---- Questions -------------------------------------------------------------------------------------------------- */

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

enum { BALLOT_FLOAT32 = 0, BALLOT_FLOAT64 = 1, BALLOT_UINT32 = 2 };
#define BALLOT_AXES 8 /* the most axes of a shape */

/* Numbers of each question, one, three or twelve, as they lie in the caller's memory, at any address. float64 is
 * rounded to the nearest float32, beyond its range to infinity. Of a scene with an origin (BallotSceneInfo::origin)
 * that is subtracted before, in double. Rays without pose whose origin or direction is float64, and all rays of such a
 * scene, start from within the scene's bounds if they start farther from them than two diagonals: they are moved there
 * in double before they are rounded, and t is told as if they had not been. Numbers that stand for all questions are
 * read before the call returns, also by ballot_submit(). What many questions share is carried to a GPU once. */
typedef struct BallotColumn {
  const void* data BALLOT_ZERO;              /* of the first question; NULL: the column's default */
  ptrdiff_t stride[BALLOT_AXES] BALLOT_ZERO; /* bytes from one question to the next along each axis; 0: one for all */
  uint32_t type BALLOT_ZERO;                 /* BALLOT_FLOAT32 or BALLOT_FLOAT64; of words BALLOT_UINT32 */
  ptrdiff_t gap BALLOT_ZERO;                 /* bytes between a number and the next of a question; 0: side by side */
} BallotColumn;

/* Rays. {n} is the shape of n rays, {h, w} that of h rows of w, whose neighbours in the last axis are neighbours in the
 * results. */
typedef struct BallotRays {
  BALLOT_SIZE(BallotRays);
  size_t shape[BALLOT_AXES] BALLOT_ZERO; /* a zero behind the first number, and what follows, is no axis */
  BallotColumn origin BALLOT_ZERO;       /* x, y, z */
  BallotColumn direction BALLOT_ZERO;    /* x, y, z */
  BallotColumn t_min BALLOT_ZERO;        /* NULL: 0 */
  BallotColumn t_max BALLOT_ZERO;        /* NULL: no end */
  BallotColumn mask BALLOT_ZERO; /* word: an instance is left out whose mask shares no bit with it; NULL: all bits */
  /* Twelve numbers, a 3 x 4 matrix m by rows, as of BallotInstances: moves the origin o as a point and the direction d
   * as a vector; t keeps its meaning. NULL: none. In a scene with an origin all is computed in double, by the host.
   * Else m is rounded to float32; then the host and every device compute o'[i]
   * as ((m[i][0] * o[0] + m[i][1] * o[1]) + m[i][2] * o[2]) + m[i][3] and d'[i] so without the last term, each product
   * and sum rounded to float32: bit for bit the same, but for parts below 2^-126, which devices may take for 0. A pose
   * of all rays is finite; a ray of one that is not is dead. {poses, h, w} with the strides of direction {0, .., ..}
   * and of pose {.., 0, 0} are the rays of a camera or scanner from each pose. */
  BallotColumn pose BALLOT_ZERO;
  BallotColumn weight BALLOT_ZERO; /* for the sums of BallotHits alone; NULL: 1. One that is not finite is refused */
  /* A word: the triangle of this number, as of BallotHit::prim, is left out, such as the one that the ray leaves; NULL
   * or BALLOT_MISS: none. */
  BallotColumn excluded BALLOT_ZERO;
  /* A word: instances of other groups are left out, but for those that are shared (BallotInstances::groups); NULL:
   * none is. A ray passes by the others at once, however many lie around it. */
  BallotColumn group BALLOT_ZERO;
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

/* Points. */
typedef struct BallotPoints {
  BALLOT_SIZE(BallotPoints);
  size_t shape[BALLOT_AXES] BALLOT_ZERO; /* as in BallotRays */
  BallotColumn at BALLOT_ZERO;           /* x, y, z; a point that is not finite is near nothing, and outside */
  /* Triangles farther away are not looked for; NULL: no limit. One for all is above 0, or of ballot_list_within() 0; a
   * point whose own is negative or NaN is near nothing, and outside. */
  BallotColumn limit BALLOT_ZERO;
  /* A word: an instance is left out whose mask shares no bit with it; NULL: all bits. This one, excluded and group not
   * with signed distances and inside, which are told of the whole scene. */
  BallotColumn mask BALLOT_ZERO;
  /* One number of each, as y and z, instead of at. {nx, ny, nz} with strides {4, 0, 0}, {0, 4, 0} and {0, 0, 4} are a
   * grid of three axes. */
  BallotColumn x BALLOT_ZERO;
  BallotColumn y BALLOT_ZERO;        /* beside x */
  BallotColumn z BALLOT_ZERO;        /* beside x */
  BallotColumn excluded BALLOT_ZERO; /* as BallotRays::excluded */
  BallotColumn group BALLOT_ZERO;    /* as BallotRays::group */
} BallotPoints;

/* Returns points that lie side by side: three floats each. */
static inline BallotPoints ballot_points(const float* xyz, size_t count) {
  BallotPoints points = BALLOT_INIT(BallotPoints);
  points.shape[0] = count;
  points.at.data = xyz, points.at.stride[0] = (ptrdiff_t)(3 * sizeof(float));
  return points;
}

/* ---- How to answer ---------------------------------------------------------------------------------------------- */

/* How to answer questions. Zero is what is usual: nearest hits, watertight, by the method that is fastest here. What
 * begins with the name of a kind of answer belongs to that alone, and is refused elsewhere: hits are those of
 * ballot_trace(), crossings those of ballot_list_crossings(), points are asked by ballot_query_points(). */
typedef struct BallotQuery {
  BALLOT_SIZE(BallotQuery);
  BallotBool any BALLOT_ZERO; /* Of hits: 1: some hit, for visibility and shadows; 0: the nearest */
  /* Of hits and crossings: the first so many triangles that each ray crosses, at most 2^32 - 2. Hits then are rows of
   * so many, filled up with misses. 0: one hit; of crossings all. Up to 16 are looked for no farther than they lie. */
  uint32_t first BALLOT_ZERO;
  BallotText method BALLOT_ZERO; /* Of hits: the traversal method, as `ballot methods` lists them; NULL: "auto" */
  /* Of hits, crossings and points: "watertight", or "exact": what is found, and its order, are those of exact
   * arithmetic; the host decides what the device leaves open. "double": as watertight, but in float64, of vertices and
   * rays in double as they were given, about the origins: t is within 2^-47 of the ray's distance from the scene. It
   * needs shaderFloat64, as "exact" does. The host answers crossings, hits with filters and points, without instances,
   * alpha, strongest, pseudonormals and arrays on the device. Files have float32 vertices. Hits have "plain" and "fast"
   * as well: float32 without promises. NULL: "watertight". */
  BallotText numeric BALLOT_ZERO;
  BallotText knobs BALLOT_ZERO; /* Of hits: settings of the method, as "vote=count,lanes=8"; NULL: its defaults */
  /* Of hits: for method auto a ray kind ("primary", "shadow", "ao", "diffuse", ...), or "coherent", "mixed",
   * "incoherent"; NULL: it looks at the rays. */
  BallotText ray_class BALLOT_ZERO;
  /* Of hits and crossings: "back" or "front": triangles that a ray meets from there are left out: of closed meshes
   * "back" those where it leaves, "front" those where it enters. The front is the side from which the vertices run
   * counter-clockwise. NULL: "none". */
  BallotText cull BALLOT_ZERO;
  /* Of hits and crossings: 1: a triangle is left out where its surface stops nothing: where the alpha of material,
   * texture and vertex colours is below the cutoff of a mask, or 0. Changes nothing where all surfaces are opaque, as
   * in scenes from arrays. Not with numeric "exact", because textures are read in float32. */
  BallotBool alpha BALLOT_ZERO;
  /* Of points: what decides what is inside. "parity": the number of crossings of one ray, of closed meshes alone.
   * "pseudonormal": the side of the nearest triangle, at its corners and edges by the angle-weighted sum of the normals
   * there (Baerentzen and Aanaes 2005); of meshes with open edges too, if their triangles are wound alike. Without a
   * triangle within the limit a point is not inside. "winding": whether the winding number is above 1/2; of any
   * triangles that mostly face outwards. NULL: "parity". */
  BallotText sign BALLOT_ZERO;
  /* For questions of ballot_trace_buffers(), ballot_query_point_buffers() and ballot_list_buffers(): a word for each,
   * as BallotRays::mask and BallotPoints::mask, or one record for all, in an array of BALLOT_RECORD_UINT32 on the
   * device; NULL: all bits. */
  BallotTarget masks BALLOT_ZERO;
  /* Of points: 1: go on with a mesh that sign refuses; answers near its faults are then arbitrary. */
  BallotBool assume_closed BALLOT_ZERO;
  /* Called now and then with the share that is done, from the thread that works; also before the call waits for another
   * one, or for work that does not stop. Returning non-zero ends the call with BALLOT_ERROR_INTERRUPTED; what is
   * written to the outputs by then is unspecified. */
  BallotProgress progress BALLOT_ZERO;
  /* For the sums of ballot_trace_buffers(): as BallotRays::weight, of each ray, or one record for all, in an array of
   * BALLOT_RECORD_FLOAT32 on the device; NULL: 1. One that is not finite fails the call, which names the first; sums
   * are then unspecified. */
  BallotTarget weights BALLOT_ZERO;
  /* Of hits: the last so many triangles that each ray crosses, 1 to 16, the farthest first, at equal t the smallest
   * prim. Hits are rows of so many, filled up with misses. 0: none. Not beside first. */
  uint32_t last BALLOT_ZERO;
  BallotTarget excluded BALLOT_ZERO; /* as masks: BallotRays::excluded, BallotPoints::excluded; NULL: none */
  BallotTarget groups BALLOT_ZERO;   /* as masks: BallotRays::group, BallotPoints::group; NULL: none is left out */
  /* Of hits: so many of the triangles that each ray crosses, 1 to 16, whose `value` is largest, the largest first, of
   * equal ones the first crossed. NaN, as of meshes without the attribute, is least. Hits are rows of so many, filled
   * up with misses. Takes some 40 bytes of the host for each crossing of all rays, also of rays on the device. 0: none.
   * Not beside first and last. */
  uint32_t strongest BALLOT_ZERO;
  BallotText value BALLOT_ZERO; /* Of hits: the name of the attribute of one number that strongest goes by */
  /* Of points: of winding numbers: triangles together count by three terms of a series if they are farther away than
   * so many radii of a ball around them. At least 1; 0: 2 */
  float beta BALLOT_ZERO;
} BallotQuery;

/* What a call took. */
typedef struct BallotTimes {
  BALLOT_SIZE(BallotTimes);
  double seconds BALLOT_ZERO;   /* wall time of the call inside the library */
  double device_ms BALLOT_ZERO; /* time of the traversal on the device, and of writing columns there */
  uint64_t hits BALLOT_ZERO;    /* rays that hit, points that found a triangle; 0 of arrays on the device */
} BallotTimes;

/* ---- Rays ------------------------------------------------------------------------------------------------------- */

/* A hit. On a miss prim is BALLOT_MISS, t infinity, u = v = 0. */
typedef struct BallotHit {
  float t;       /* distance, in multiples of dir; of ballot_list_within() in scene units */
  uint32_t prim; /* the triangle, counted through the instances of the scene */
  float u, v;    /* weights of its vertices 1 and 2: barycentric coordinates, 0 to 1 */
} BallotHit;
#define BALLOT_MISS 0xFFFFFFFFu /* the number of no triangle, mesh or instance */

/* Where sums go. */
typedef struct BallotSums {
  double* data BALLOT_ZERO; /* NULL: they are not wanted */
  size_t count BALLOT_ZERO; /* entries that there is room for */
} BallotSums;

/* Where the values of an attribute go. */
typedef struct BallotValues {
  BallotText attribute BALLOT_ZERO; /* BallotAttribute::name, of some mesh */
  /* Its components of each answer; NaN where there is none: on a miss, and of a mesh that lacks the attribute. The
   * device finds them, for whichever memory, so their bits do not depend on that. */
  float* data BALLOT_ZERO;
} BallotValues;

/* Where the results go: arrays of an entry for each ray, or of BallotQuery::first, last or strongest entries, in
 * their order. Those that are NULL are not written. The arrays must not overlap the rays or each other. */
typedef struct BallotHits {
  BALLOT_SIZE(BallotHits);
  BallotHit* hits BALLOT_ZERO;     /* whole hits */
  float* t BALLOT_ZERO;            /* distance, in multiples of the direction; on a miss infinity */
  uint32_t* prims BALLOT_ZERO;     /* number of the triangle within its mesh; on a miss BALLOT_MISS */
  uint32_t* mesh_ids BALLOT_ZERO;  /* BallotMesh::id, or as BallotSceneOptions::ids says; on a miss BALLOT_MISS */
  float* uvs BALLOT_ZERO;          /* 2 each: weights of the vertices 1 and 2; on a miss 0 */
  float* normals BALLOT_ZERO;      /* 3 each: unit normal, by the right-hand rule over the vertices; on a miss 0 */
  uint8_t* occluded BALLOT_ZERO;   /* 1: hit, 0: miss */
  uint32_t* instances BALLOT_ZERO; /* number of the instance; on a miss BALLOT_MISS */
  /* Sums: the weight of each ray, BallotRays::weight, is added to the entry of what it hits; to one for each of its
   * hits if it has `first` or `last`. The last entry is of rays that hit nothing. Without weights each counts as 1, so
   * these are numbers of rays. With W the largest |weight|, e its binary exponent, at least -126, and n the number of
   * hits asked for, weights are rounded to whole multiples of 2^(e + ceil(log2 n) - 61), to even ones where two are as
   * near, these are added as whole numbers, and each sum is rounded once to double. So its bits do not depend on the
   * order of the rays, nor on where and how they are traced: the largest weights lose nothing up to 2^38 rays. */
  BallotSums prim_sums BALLOT_ZERO;     /* by BallotHit::prim: BallotSceneInfo::instance_triangles entries, and 1 */
  BallotSums instance_sums BALLOT_ZERO; /* by place, as of ballot_scene_instance(): BallotSceneInfo::instances, and 1 */
  BallotSums mesh_sums BALLOT_ZERO;     /* by place, as of ballot_scene_mesh(): BallotSceneInfo::meshes, and 1 */
  /* 3 each: where it is, on a miss 0: the point of the triangle that u and v name, in double, rounded once, so within
   * half a unit of the last place and 2^-50 of the vertices. The vertices are those of the world, rounded to float32,
   * as of normals. On a shape it is origin + t * direction, so computed, with the error of t */
  float* positions BALLOT_ZERO;
  /* 1: the ray meets the front, as BallotQuery::cull says; 0: the back, or a miss. Wrong at most where the direction is
   * within 2^-50 of the plane of the triangle as the world has it, of shapes 2^-22; there cull may say otherwise */
  uint8_t* front BALLOT_ZERO;
  /* number of the material, in the order of the file; 0 of meshes in memory, on a miss BALLOT_MISS */
  uint32_t* materials BALLOT_ZERO;
  /* 4 each: linear red, green, blue of the base colour and opacity, as pictures and BallotQuery::alpha have them:
   * factors of the material times texture times colours of vertices; the opacity of a mask is 0 or 1. Textures are read
   * at their finest level, in float32. On a miss 0. Made by the device, as values are */
  float* colors BALLOT_ZERO;
  /* 3 each: unit normal between those that the vertices were given, bent by the material's normal map, on
   * the side of normals; these where there is none. On a miss 0. Made by the device, as values are */
  float* shading_normals BALLOT_ZERO;
  const BallotValues* values BALLOT_ZERO; /* attributes, each once */
  size_t value_count BALLOT_ZERO;         /* how many */
  /* distance in double: of the ray as it was given and the plane of the triangle, between its nearest and its farthest
   * vertex; of shapes as t, with its error; on a miss infinity */
  double* t_double BALLOT_ZERO;
  /* 3 each: where it is, in double: the ray as it was given at t_double; on a miss 0 */
  double* positions_double BALLOT_ZERO;
} BallotHits;

/* Traces rays, nearest, any or first hits, and returns when the results are written. Neighbours in the array share a
 * subgroup: order rays for coherence. Rays in rows, as of a camera or a turning scanner, are traced in tiles of 8 x 8.
 * Masks, excluded, groups, cull, alpha, first, last and strongest make hits some of the crossings that
 * ballot_list_crossings() finds, by one method; the others are refused. query and times may be NULL. Zero rays are
 * allowed. */
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

/* Where lists go: a list of triangles for each question. */
typedef struct BallotLists {
  BALLOT_SIZE(BallotLists);
  int64_t* counts BALLOT_ZERO;  /* of each question: how many are listed; NULL: not wanted */
  int64_t* offsets BALLOT_ZERO; /* one more than questions: where each list begins among all, then their sum; NULL */
  /* Takes the lists of questions [first, first + count), in parts, one list after the other. Non-zero ends the call
   * with BALLOT_ERROR_INTERRUPTED. NULL: they are only counted. */
  int (*take)(void* user, uint64_t first, size_t count, const uint32_t* counts, const BallotHit* hits) BALLOT_ZERO;
  void* user BALLOT_ZERO; /* given to take */
} BallotLists;

/* Finds all crossings of rays and triangles with t in [t_min, t_max]: each triangle once, with the t of a "watertight"
 * hit, those of a ray in order of t, at equal t of prim. From outside to outside a ray crosses a closed mesh an even
 * number of times. A ray that passes through a closed surface at an edge or a vertex crosses it there once; one that
 * only touches it there, twice or not at all. A ray in a triangle's plane does not cross it. The first crossings are
 * the beginning of the whole list, bit for bit. With numeric "exact" the order among instances is that of t as
 * reported. Takes memory for some 4 million crossings at a time, and more for a ray that has more. query and times may
 * be NULL. */
BALLOT_API BallotStatus ballot_list_crossings(BallotScene* scene, const BallotRays* rays, const BallotLists* lists,
                                              const BallotQuery* query, BallotTimes* times);

#endif
