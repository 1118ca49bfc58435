/* Answers about points and boxes: nearest points, distances, what is inside, the triangles around. ballot_c.h includes
 * it behind ballot_c_answers.h, which has the points. */
#ifndef BALLOT_C_POINTS_H
#define BALLOT_C_POINTS_H

#ifndef BALLOT_C_H
#error include ballot/ballot_c.h
#endif

/* The nearest point, 32 bytes. Without a triangle within the limit distance is infinite, prim BALLOT_MISS, the rest
 * 0. */
typedef struct BallotNearestPoint {
  float at[3];    /* x, y, z */
  float distance; /* from the point that was asked for */
  uint32_t prim;  /* the triangle, counted through the instances of the scene */
  float u, v;     /* weights of its vertices 1 and 2 */
  uint32_t spare; /* without meaning */
} BallotNearestPoint;

/* Where the answers go, as in BallotHits. Without a triangle within the limit distances are infinite, numbers
 * BALLOT_MISS, the rest 0. */
typedef struct BallotNearest {
  BALLOT_SIZE(BallotNearest);
  float* distances BALLOT_ZERO;            /* from the nearest triangle */
  float* points BALLOT_ZERO;               /* 3 each: the nearest point */
  uint32_t* prims BALLOT_ZERO;             /* its triangle within its mesh; of those as near the smallest number */
  uint32_t* mesh_ids BALLOT_ZERO;          /* as in BallotHits */
  float* uvs BALLOT_ZERO;                  /* 2 each: weights of the vertices 1 and 2 */
  float* normals BALLOT_ZERO;              /* 3 each: unit normal of the triangle, by the right-hand rule */
  float* signed_distances BALLOT_ZERO;     /* negative inside, as BallotQuery::sign says */
  uint8_t* inside BALLOT_ZERO;             /* 1: inside, as BallotQuery::sign says */
  BallotNearestPoint* nearest BALLOT_ZERO; /* whole nearest points */
  uint32_t* materials BALLOT_ZERO;         /* as in BallotHits */
  float* colors BALLOT_ZERO;               /* 4 each: as in BallotHits */
  float* shading_normals BALLOT_ZERO;      /* 3 each: as in BallotHits */
  const BallotValues* values BALLOT_ZERO;  /* attributes, each once, as in BallotHits */
  size_t value_count BALLOT_ZERO;          /* how many */
  /* in double, at most 2^-50 of coordinates too small; of shapes as distances */
  double* distances_double BALLOT_ZERO;
  /* 3 each: in double, what u and v of its triangle name; of shapes as points */
  double* points_double BALLOT_ZERO;
  float* windings BALLOT_ZERO;                 /* winding numbers: 1 inside of a closed mesh, 0 outside */
  double* signed_distances_double BALLOT_ZERO; /* distances_double, negative inside, as BallotQuery::sign says */
} BallotNearest;

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
 * Winding   The sum of the signed solid angles of all triangles over 4 pi (Barill and others 2018), for soups and
 *           meshes with gaps. The error falls as 1 / beta^4: with beta 2 it was at most 0.02 on the meshes that were
 *           measured, 0.0006 in the mean, with 4 a twentieth. On the surface it is arbitrary between the values on its
 *           sides. Not of instances and shapes (layout "merge" makes one mesh), nor with numeric "exact". Neither
 *           limits nor closedness count. 160 bytes a leaf.
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
                                            const BallotQuery* query, BallotTimes* times);

/* Finds all triangles within the limit of each point, which is its radius: with t the distance, within the bound of
 * ballot_query_points(), and u = v = 0, those of a point in order of t, at equal t of prim. A triangle at the limit
 * counts. Needs a limit for all, or of each point. query may have progress alone; it and times may be NULL. */
BALLOT_API BallotStatus ballot_list_within(BallotScene* scene, const BallotPoints* points, const BallotLists* lists,
                                           const BallotQuery* query, BallotTimes* times);

/* Closed boxes with sides along the axes. One whose low corner is above its high corner, or NaN, overlaps nothing. */
typedef struct BallotBoxes {
  BALLOT_SIZE(BallotBoxes);
  size_t shape[BALLOT_AXES] BALLOT_ZERO; /* as in BallotRays */
  BallotColumn low BALLOT_ZERO;          /* x, y, z; infinite: no bound. In double they are rounded outward */
  BallotColumn high BALLOT_ZERO;         /* likewise */
  BallotColumn mask BALLOT_ZERO;         /* as BallotRays::mask */
  BallotColumn excluded BALLOT_ZERO;     /* as BallotRays::excluded */
  BallotColumn group BALLOT_ZERO;        /* as BallotRays::group */
} BallotBoxes;

/* Returns boxes that lie as rows of six floats: low, high. */
static inline BallotBoxes ballot_boxes(const float* rows, size_t count) {
  BallotBoxes boxes = BALLOT_INIT(BallotBoxes);
  boxes.shape[0] = count;
  if (!rows) return boxes;
  boxes.low.data = rows, boxes.high.data = rows + 3;
  boxes.low.stride[0] = boxes.high.stride[0] = (ptrdiff_t)(6 * sizeof(float));
  return boxes;
}

/* Finds all triangles that have a point in common with each box, such as those of a voxel: those of exact arithmetic,
 * with t = u = v = 0, those of a box in order of prim. Touching counts. Triangles are those of ballot_query_points(),
 * about the scene's origin; the host decides what the device leaves open. Not of shapes. query may have progress alone;
 * it and times may be NULL. (Akenine-Moller. Fast 3D triangle-box overlap testing. Journal of Graphics Tools 6(1),
 * 2001) */
BALLOT_API BallotStatus ballot_list_overlapping(BallotScene* scene, const BallotBoxes* boxes, const BallotLists* lists,
                                                const BallotQuery* query, BallotTimes* times);

/* Where another scene is placed. */
typedef struct BallotPoses {
  BALLOT_SIZE(BallotPoses);
  size_t shape[BALLOT_AXES] BALLOT_ZERO; /* as in BallotRays */
  BallotColumn pose BALLOT_ZERO;         /* 12 numbers within +-1e30: 3 rows of 4; NULL: it stays where it is */
  BallotColumn limit BALLOT_ZERO;        /* what is farther away is not looked for; NULL: no limit */
} BallotPoses;

/* How far scenes are apart, where the answers go. Each may be NULL. Beyond the limit, or without a triangle, a distance
 * is infinite, numbers are BALLOT_MISS, the rest is 0. */
typedef struct BallotClearance {
  BALLOT_SIZE(BallotClearance);
  double* distances BALLOT_ZERO;     /* the smallest distance of a triangle of the one from one of the other */
  uint32_t* prims BALLOT_ZERO;       /* that triangle of the scene, counted as BallotHit::prim */
  uint32_t* other_prims BALLOT_ZERO; /* and of the other scene */
  double* points BALLOT_ZERO;        /* 3 each: the nearest point of the former */
  double* other_points BALLOT_ZERO;  /* 3 each: of the latter, where the pose puts it */
} BallotClearance;

/* Finds the smallest distance between a scene and another one of the same device, which poses place, such as the parts
 * of a machine in a cell: 0 if they touch or pass through each other. With M the largest distance of corners of the two
 * triangles it is off by 2^-49 M at most; triangles are those of ballot_query_points(). Of pairs at the same distance
 * it is that of the smallest prim, then of the smallest other prim; of those at 0 some pair. The host finds it in
 * double precision, by a walk of both trees at once, each pose by a thread. Not of shapes. Neither scene may be changed
 * meanwhile. poses may be NULL: one, where the other scene stays as it is. query may have progress alone; it and times
 * may be NULL. */
BALLOT_API BallotStatus ballot_clearance(BallotScene* scene, BallotScene* other, const BallotPoses* poses,
                                         const BallotClearance* to, const BallotQuery* query, BallotTimes* times);

#endif
