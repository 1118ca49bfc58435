/* Points and crossings: the part of Ballot's C interface beyond the nearest hit. ballot_c.h includes it. */
#ifndef BALLOT_C_POINTS_H
#define BALLOT_C_POINTS_H

#ifndef BALLOT_C_H
#error include ballot/ballot_c.h
#endif

/* Points, as BallotRays. */
typedef struct BallotPoints {
  size_t size;
  size_t shape[BALLOT_AXES]; /* as in BallotRays */
  BallotColumn at;           /* x, y, z; a point that is not finite is near nothing, and outside */
  BallotColumn
      limit; /* triangles farther away are not looked for; NULL: no limit. One for all is above 0; a point whose
                         own is negative or NaN is near nothing, and outside */
} BallotPoints;

/* Returns points that lie side by side: three floats each. */
static inline BallotPoints ballot_points(const float* xyz, size_t count) {
  BallotPoints points = BALLOT_INIT(BallotPoints);
  points.shape[0] = count;
  points.at.data = xyz, points.at.stride[0] = (ptrdiff_t)(3 * sizeof(float));
  return points;
}

/* Where the answers go, as in BallotHits. Without a triangle distances are infinite, numbers BALLOT_MISS, the rest
 * 0. */
typedef struct BallotNearest {
  size_t size;
  float* distances;           /* from the nearest triangle, of those as near the one with the smallest number */
  float* points;              /* x, y, z of the nearest point */
  uint32_t *prims, *mesh_ids; /* of the triangle, as in BallotHits */
  float *uvs, *normals;       /* two floats: u, v; three: unit normal of the triangle, by the right-hand rule */
  /* Negative inside. What is inside: by the parity of crossings, of a closed mesh alone, or by
   * BallotPointQuery::sign. */
  float* signed_distances;
  uint8_t* inside; /* 1: inside */
} BallotNearest;

/* What decides the sign of a distance, and what is inside. PARITY: the number of crossings of one ray. PSEUDONORMAL:
 * the side of the nearest triangle, at its corners and edges by the angle-weighted sum of the normals there (Baerentzen
 * and Aanaes 2005); for meshes with open edges too, if their triangles are wound alike. Without a triangle within the
 * limit a point is not inside. */
enum { BALLOT_SIGN_PARITY = 0, BALLOT_SIGN_PSEUDONORMAL = 1 };

/* How to answer points. */
typedef struct BallotPointQuery {
  size_t size;
  uint32_t assume_closed; /* 1: go on although edges are open, or triangles are wound against each other where the sign
                             is by pseudonormals; the answer near these is then arbitrary */
  int (*progress)(void* user, double done); /* as in BallotQuery */
  void* user;                               /* given to progress */
  const char* numeric;                      /* "watertight" or "exact"; NULL: "watertight" */
  uint32_t sign;                            /* BALLOT_SIGN_... */
} BallotPointQuery;

/* Finds the nearest point of the scene for each point. Let M be the distance from the point to the farthest vertex of
 * the reported triangle, M' that of the nearest triangle, and R the largest distance to a point of the scene along an
 * axis.
 *
 * Distance  Has an error of at most 64 * 2^-24 (M + M') + 2^-85 R, also of thin triangles. Triangles that share an edge
 *           or a vertex compute the same distance from it.
 * Parity    One ray along +x. Right if every triangle is farther away than 16 * 2^-24 times the distance to its own
 *           farthest vertex and none is smaller than 2^-88 R, also where the ray passes exactly through an edge or a
 *           vertex. On the surface the answer is that of a point beside it, towards +x, then +y, then +z. Inside of two
 *           surfaces that are nested or overlap is outside. Refused if an edge has an odd number of triangles.
 * Pseudonormals  Agree with parity on meshes that are closed, manifold, wound alike and free of self-intersections. On
 *           the surface a point is not inside. Near a border it is behind the plane of the triangle there or in front
 *           of it, however far it is. The sign may be wrong within the bound of the distance, beside an edge within
 *           about that divided by the sine of half the angle between its faces; at sharp corners no bound is proved.
 *           Refused if two triangles run along an edge in the same direction. 72 bytes a triangle.
 * Exact     With numeric "exact" the nearest triangle and what is inside are those of exact arithmetic, signs by
 *           pseudonormals for these as rounded to float32. The host decides what the device leaves open, and looks for
 *           each nearest triangle again.
 *
 * Instances The triangles are those of moved vertices, rounded to float32. By parity a point is inside if it is so of
 *           an odd number of instances, whose meshes must be closed; M is then that in the space of the mesh, times the
 *           largest stretch of the matrix, and what the point rounds to there adds to the bound.
 *
 * Vertices are one if their coordinates are equal. Triangles without area are left out; where one closes a gap, the
 * edges around it count as open. Answers depend neither on the tree nor on the order of the points, with one exception:
 * of a point farther away than 16 times the scene's longest side the nearest triangle may be another one within the
 * same bound. Points as far as 3e38 are answered. */
BALLOT_API BallotStatus ballot_query_points(BallotScene* scene, const BallotPoints* points, const BallotNearest* to,
                                            const BallotPointQuery* query, BallotTimes* times);

/* A point on the device, 16 bytes. One with a component that is not finite, or a limit that is negative or NaN, is near
 * nothing, and outside. */
typedef struct BallotPoint {
  float at[3]; /* x, y, z */
  float limit; /* triangles farther away are not looked for; infinity: no limit */
} BallotPoint;

/* The nearest point, 32 bytes. Without a triangle within the limit distance is infinite, prim BALLOT_MISS, the rest
 * 0. */
typedef struct BallotNearestPoint {
  float at[3];    /* x, y, z */
  float distance; /* from the point that was asked for */
  uint32_t prim;  /* the triangle, counted through all meshes of the scene */
  float u, v;     /* weights of its vertices 1 and 2 */
  uint32_t spare; /* without meaning */
} BallotNearestPoint;

/* Answers points [0, count) of one array by another; both of the scene's device. What is asked is what `answers` holds:
 * BALLOT_RECORD_NEAREST, BALLOT_RECORD_SIGNED_DISTANCE, or BALLOT_RECORD_INSIDE, 1 for each point that is inside.
 * Answers and errors are those of ballot_query_points(), but with a limit of each point; query->progress may end
 * the call, but is told no share.
 * Points keep their order: put those that are near each other next to each other, as neighbours share a subgroup. Only
 * numeric "exact" brings points to the host. Returns when the answers are written. BallotTimes::hits is not counted. */
BALLOT_API BallotStatus ballot_query_point_buffers(BallotScene* scene, BallotBuffer* points, BallotBuffer* answers,
                                                   uint64_t count, const BallotPointQuery* query, BallotTimes* times);

/* The triangles that are left out: those that a ray meets from behind or from the front. The front is the side from
 * which the vertices run counter-clockwise. */
enum { BALLOT_CULL_NONE = 0, BALLOT_CULL_BACK = 1, BALLOT_CULL_FRONT = 2 };

/* Options of ballot_list_crossings(). A ray that passes through a closed surface at an edge or a vertex crosses it
 * there once. A ray that only touches the surface there crosses it twice or not at all. */
typedef struct BallotLists {
  size_t size;
  uint32_t most;   /* the first crossings of each ray to be listed; 0: all */
  int64_t* counts; /* for each ray: how many are listed; NULL: not wanted */
  /* Takes the crossings of rays [first, first + rays), in parts: those of each ray one after the other, in order of t,
   * at equal t of prim. Non-zero ends the call with BALLOT_ERROR_INTERRUPTED. NULL: they are only counted. */
  int (*take)(void* user, uint64_t first, size_t rays, const uint32_t* counts, const BallotHit* hits);
  void* user;                /* given to take and progress */
  const char* numeric;       /* "watertight" or "exact"; NULL: "watertight" */
  uint32_t cull;             /* BALLOT_CULL_... */
  const uint32_t* ray_masks; /* of each ray: instances are left out as ballot_scene_set_masks() says; NULL: all bits */
  /* 1: leave out a triangle where its surface stops nothing: where the alpha of material, texture and vertex colours is
   * below the cutoff of a mask, or 0. Changes nothing where all surfaces are opaque, as in scenes from arrays. Not with
   * numeric "exact", because textures are read in float32. */
  uint32_t alpha;
  int (*progress)(void* user, double done); /* as in BallotQuery */
} BallotLists;

/* Finds all crossings of rays and triangles with t in [t_min, t_max]: each triangle once, with the t of a "watertight"
 * hit. From outside to outside a ray crosses a closed mesh an even number of times. A ray in a triangle's plane does
 * not cross it. The first crossings are the beginning of the whole list, bit for bit; up to 16 a ray are looked for no
 * farther than they lie. With numeric "exact" numbers and order are those of exact arithmetic, the order among
 * instances that of t as reported; the host decides what the device leaves open. Takes memory for some 4 million
 * crossings at a time, and more for a ray that has more. times may be NULL. */
BALLOT_API BallotStatus ballot_list_crossings(BallotScene* scene, const BallotRays* rays, const BallotLists* lists,
                                              BallotTimes* times);

#endif
