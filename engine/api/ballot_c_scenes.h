/* Scenes: meshes, instances, and how they move. ballot_c.h includes it. */
#ifndef BALLOT_C_SCENES_H
#define BALLOT_C_SCENES_H

#ifndef BALLOT_C_H
#error include ballot/ballot_c.h
#endif

/* How the indices of a mesh lie in memory. */
typedef enum BallotIndexType { BALLOT_INDEX_NONE = 0, BALLOT_INDEX_U16 = 1, BALLOT_INDEX_U32 = 2 } BallotIndexType;

/* What the values of an attribute are of. */
typedef enum BallotValuesOf { BALLOT_OF_VERTICES = 0, BALLOT_OF_PRIMS = 1, BALLOT_OF_MESH = 2 } BallotValuesOf;

/* Numbers that a mesh has beside its geometry, which answers tell where they meet it: BallotValues. Any numbers, NaN
 * and infinity as well. They lie on the device alone, 4 bytes each, and cost nothing where no answer asks for them. */
typedef struct BallotAttribute {
  BALLOT_SIZE(BallotAttribute);
  /* Any text of 1 to 255 bytes but the name of a column of BallotHits or BallotNearest; once in a mesh */
  BallotText name BALLOT_ZERO;
  /* What its values are of, in their order: the vertices of a mesh of triangles, of a file's mesh the corners of its
   * triangles; its triangles or shapes; or the whole, one value. */
  BallotValuesOf of BALLOT_ZERO;
  uint32_t components BALLOT_ZERO; /* numbers of a value, 1 to 4, as in other meshes; 0: 1 */
  size_t count BALLOT_ZERO;        /* number of values; must be that of what they are of */
  const float* data BALLOT_ZERO;   /* the numbers of each value side by side; read by the call */
  size_t stride BALLOT_ZERO;       /* bytes from one value to the next, a multiple of 4; 0: side by side */
  /* Instead of data: the first `count` BALLOT_RECORD_FLOAT32, FLOAT32X2, X3 or X4, by components, of an array on the
   * scene's device, copied there by the call. */
  BallotTarget buffer BALLOT_ZERO;
  /* Of vertices: 1: a hit has the value of the vertex whose weight is largest, of equal ones the first. 0: with
   * those of the vertices a, b, c it has a + (u (b - a) + v (c - a)), each operation rounded to float32: equal values
   * stay as they are. */
  BallotBool nearest BALLOT_ZERO;
} BallotAttribute;

/* A mesh: triangles, or shapes of another kind. The library copies what it needs before the call returns; arrays on the
 * device may go then, too. */
typedef struct BallotMesh {
  BALLOT_SIZE(BallotMesh);
  const float* positions BALLOT_ZERO;     /* x, y, z of each vertex; finite, at most 1e12 */
  size_t vertex_count BALLOT_ZERO;        /* number of vertices, at least those of one shape */
  size_t position_stride BALLOT_ZERO;     /* bytes from one vertex to the next, a multiple of 4; 0: 12 */
  const void* indices BALLOT_ZERO;        /* as many for each shape as it has vertices; NULL: vertices 0, 1, 2, ... */
  size_t index_count BALLOT_ZERO;         /* a multiple of that, of one shape at least; 0 without indices */
  BallotIndexType index_type BALLOT_ZERO; /* 16 or 32 bits; none without indices */
  uint32_t id BALLOT_ZERO;                /* any number; BallotHits::mesh_ids reports it */
  const float* normals BALLOT_ZERO;       /* unit normal of each vertex, for pictures; NULL: flat. Of discs their own */
  size_t normal_stride BALLOT_ZERO;       /* bytes, as position_stride */
  /* What it is made of; NULL: "triangles", three vertices each. "spheres": a vertex with a radius each. "discs": a
   * vertex, a radius, a normal each; flat, met from both sides. "capsules": two vertices with radii each, the convex
   * hull of two spheres. "boxes": two opposite corners each, along the axes of the mesh. "heights": a raster, whose
   * cells are two triangles each.
   *
   * A ray enters a closed shape and leaves it: two hits, at ends of the same t with one normal. u and v of a hit are
   * its outward normal by the octahedral map, to [0, 1]. The front is the outside, of a disc the side of its normal.
   * The answer is that of a shape that lies elsewhere by at most 8 * 2^-24 of its largest distance from the ray's
   * origin along an axis, with t off by 15 * 2^-24 of that over the direction's main component. A mesh of shapes lies
   * in a tree of its own, whatever the layout. Closest points need matrices that turn and scale alike along all axes.
   * In modes "watertight" and "plain", and in "exact" nearest and any hits of rays, without filters: the host finds
   * these without rounding, whatever the device, t and the normal to float32. In pictures they have their own normals,
   * and give no light. Shapes of radius 0, and boxes that are flat along two axes, are never hit. */
  BallotText shapes BALLOT_ZERO;
  const float* radii BALLOT_ZERO;   /* of each vertex of spheres, discs and capsules, 0 to 1e12 */
  size_t radius_stride BALLOT_ZERO; /* bytes from one to the next, a multiple of 4; 0: 4 */
  /* Instead of positions, indices, or both: the first vertex_count BALLOT_RECORD_FLOAT32X3, and the first index_count
   * BALLOT_RECORD_UINT32, of arrays on the scene's device, which checks them. Strides and index_type are then 0. Of
   * triangles alone. */
  BallotTarget vertex_buffer BALLOT_ZERO;
  BallotTarget index_buffer BALLOT_ZERO; /* NULL without indices */
  BallotText name BALLOT_ZERO;           /* any text, in any number of meshes; NULL: "mesh N", or "scene" of one mesh */
  const BallotAttribute* attributes BALLOT_ZERO; /* that it has; of shapes none of vertices */
  size_t attribute_count BALLOT_ZERO;            /* how many */
  /* Instead of positions: in double, kept as float32 about an origin, so rounded by at most 2^-24 of the mesh's longest
   * side along an axis (BallotMeshInfo::rounding tells). position_stride 0: 24. */
  const double* positions_double BALLOT_ZERO;
  /* x, y, z of its own space: the mesh's origin. Zero: that of the scene where it lies in the world by the identity;
   * else one is found for positions_double and heights. */
  double origin[3] BALLOT_ZERO;
  /* Of "heights", instead of positions and indices: vertex_count samples row by row, position_stride bytes from one to
   * the next, 0: 4. Sample c of row r lies at corner[0] + c spacing[0], corner[1] + r spacing[1] and z = its height,
   * computed in double and kept as positions_double are. NaN: there is none, so no triangle of the sample is there; all
   * numbers may be NaN. Triangles 2 i and 2 i + 1 are of cell i, counted row by row: of the samples (r, c), (r, c + 1),
   * (r + 1, c + 1), and (r, c), (r + 1, c + 1), (r + 1, c). All answers are those of a mesh of these triangles. The
   * scene keeps 4 bytes a sample instead of 24 of indices. */
  const float* heights BALLOT_ZERO;
  size_t columns BALLOT_ZERO;    /* samples of a row, at least 2, as there are rows */
  double spacing[2] BALLOT_ZERO; /* x and y from a sample to the next; above 0 */
  double corner[2] BALLOT_ZERO;  /* x and y of sample 0 */
} BallotMesh;

/* How a scene is made. */
typedef struct BallotSceneOptions {
  BALLOT_SIZE(BallotSceneOptions);
  /* how the tree is built: "best", "balanced", "fast", "device" or "auto" (see `ballot methods`). NULL: "best" for
   * files, "auto" for meshes. "auto": "device" on a GPU, "balanced" on a CPU unless expected_rays says otherwise. */
  BallotText builder BALLOT_ZERO;
  uint32_t max_leaf BALLOT_ZERO;  /* most triangles of a leaf, 1 to 6; 0: 6 */
  float split_budget BALLOT_ZERO; /* of "best": share of references that spatial splits may add, 0 to 16; 0.5 by default
                                     (in C as 0; below 0: none) */
  BallotBool cache BALLOT_ZERO;   /* 1: keep the tree on disk, in $XDG_CACHE_HOME/ballot */
  /* how trees follow vertices that move. "refit": boxes move, its shape stays, so traces slow down as triangles
   * move apart. "rebuild": anew. NULL or "auto": refits until traces have lost as much time as a build takes. It is
   * always built anew if a triangle gains or loses its area. */
  BallotText updates BALLOT_ZERO;
  double expected_rays BALLOT_ZERO; /* hint for builder "auto": rays that will be traced in all; 0: unknown */
  BallotBool allow_outside
      BALLOT_ZERO; /* Of files: 1: it may name buffers, images and materials outside of its folder */
  /* Of files: meshes that a glTF file uses several times. "keep": each is there once, as are meshes that an animation
   * moves as a whole. "copy": each use is a moved copy. NULL or "auto": kept where that saves 4 million triangles and
   * half of the scene's, or where copies would not fit into memory. Copied all the same are meshes whose instances,
   * which take the memory of 4 triangles each, would not save half of them, and all meshes of files that deform some
   * over time. Hits are the same but for rounding. */
  BallotText instances BALLOT_ZERO;
  /* which meshes lie in one tree. "auto": those that the scene is made with, unless instances are given or files keep
   * them once. "merge": those that are placed once, by the identity. "separate": none, so each can move by itself at
   * its own cost; rays are slower the more the trees overlap. NULL: "auto". */
  BallotText layout BALLOT_ZERO;
  /* Of files: what BallotHits::mesh_ids holds, by the file's numbers. "mesh": the mesh of glTF, the group of
   * OBJ; 0 where a file has one mesh. "node": the node of glTF that places the triangle; else as "mesh". "material":
   * the triangle's. NULL: "mesh". Scenes made of meshes have BallotMesh::id. */
  BallotText ids BALLOT_ZERO;
  /* Called now and then with the share of the tree that is built, by any thread, one at a time. Returning non-zero ends
   * the call with BALLOT_ERROR_INTERRUPTED. */
  BallotProgress progress BALLOT_ZERO;
  /* Of scenes made of meshes: x, y, z of the scene's origin, from which float32 numbers are counted
   * (BallotSceneInfo::origin). Zero: one is found if numbers in double lie farther from zero than twice the scene's
   * longest side; else there is none. */
  double origin[3] BALLOT_ZERO;
  /* Of files: what points of PLY and rows of .npy are: "spheres", "discs", "capsules" or "boxes" (BallotMesh::shapes).
   * PLY's are its vertices, though it has faces. "heights": the .npy is a raster. NULL: as the file tells. */
  BallotText shapes BALLOT_ZERO;
  float radius BALLOT_ZERO; /* Of files: of points and lines of PLY, .npy and glTF that have none; 0: none is given */
  double spacing[2] BALLOT_ZERO; /* Of files: x and y from a sample of heights to the next; zero: 1 */
} BallotSceneOptions;

/* Where meshes lie in the world. A mesh may have many instances, or none. */
typedef struct BallotInstances {
  BALLOT_SIZE(BallotInstances);
  size_t count BALLOT_ZERO;           /* number of instances */
  const uint32_t* meshes BALLOT_ZERO; /* number of each instance's mesh; NULL: 0 */
  /* A 3 x 4 matrix of each instance, row by row, 12 floats: a point p of the mesh lies at m[0..2] . p + m[3] along x,
   * and so on. Finite and invertible; a mirror turns the triangles round, as moved vertices are. */
  const float* transforms BALLOT_ZERO;
  size_t transform_stride
      BALLOT_ZERO; /* bytes from one matrix to the next, a multiple of 4; 0: 48. Of 4 x 4 matrices: 64 */
  const uint32_t* masks BALLOT_ZERO;  /* of each instance, as ballot_scene_set_masks() says; NULL: all bits */
  const uint32_t* groups BALLOT_ZERO; /* of each instance, as ballot_scene_set_groups() says; NULL: BALLOT_SHARED */
  /* Instead of transforms: in double. The origins of scene and mesh are taken into account before it is rounded.
   * transform_stride 0: 96. */
  const double* transforms_double BALLOT_ZERO;
} BallotInstances;
#define BALLOT_SHARED 0xFFFFFFFFu /* the group of instances that rays and points of all groups meet */

/* Makes a scene of `count` meshes and their instances on a device. Meshes and instances are numbered from 0 in their
 * order. instances NULL: each mesh lies in the world, once, and the number of its instance is its own. Triangles are
 * numbered through the instances in their order; that number is `prim` of BallotHit. BallotHits has instance and
 * triangle apart. Triangles without area keep their number and are never hit. A scene may be empty. At most 2^31 - 1
 * triangles in all meshes, 2^32 - 3 counted through the instances. options may be NULL.
 *
 * Meshes lie in one tree or each in its own (options->layout), below a tree over the instances. That takes the memory
 * of the meshes and 160 bytes an instance on the device. A hit of an instance is a hit of its mesh by the ray
 * transformed into the mesh's space, by the same float32 operations on every device; t is the same in both spaces. At
 * equal t the instance with the smaller number is hit. With identity transforms hits are those of one tree, bit for
 * bit; in "exact" but for hits of two instances whose t are equal in float32.
 *
 * In "watertight" no ray slips through a closed mesh, whatever its transform, nor between instances with equal
 * transforms. Where the borders of instances with different transforms coincide, one may. In "exact" each instance's
 * answer is exact for the ray in its space; instances are ordered by t as reported. In "double" the ray is transformed
 * in double, by the same inverse of the matrix, which is rounded to float32; t keeps its bound for that ray.
 *
 * Refused, with the instance and the figure: entries that are not finite, matrices that cannot be inverted in float32
 * (their inverse would multiply rounding errors by more than 2^20), columns whose largest magnitude is not between
 * 2^-60 and 2^60, and instances that leave +-1e12. Method "packet-wide" cannot trace two levels. ballot_render() and
 * ballot_make_rays() refuse matrices that multiply rounding errors by more than 4096.
 *
 * The arrays of meshes may go afterwards. For later calls the scene keeps on the host, in bytes a triangle: 12 of
 * indices, 4 of materials if there are several, 36 of normals if there are some, 36 of corners, and about 36 of a tree
 * that was built there. Of the last two it keeps 4 once the device has them, until a call needs more: moves, edits,
 * exact lists, pictures, ballot_scene_triangles(). Exact lists, and moves of such a tree, add about 98 from the first
 * on; moves add 36 of the corners of before, too.
 *
 * Once a mesh has a vertex_buffer or an index_buffer, the device makes the triangles of all of them and keeps its
 * indices. Trees of builder "device" are built of these there, on a GPU with float64, and the host reads them back once
 * a later call needs them; of several trees it reads those of fewer than 65 536 triangles. It reads all at once if
 * another builder makes the trees, if a mesh has normals, or if a matrix is not the identity; then a tree of the
 * device is built there all the same. The first vertex or index that cannot be is named. */
BALLOT_API BallotStatus ballot_scene_create(BallotDevice* device, const BallotMesh* meshes, size_t count,
                                            const BallotInstances* instances, const BallotSceneOptions* options,
                                            BallotScene** scene);
/* Loads a glTF 2.0 (.gltf, .glb), OBJ, PLY or STL file, or triangles or shapes (.npy, .npz), with its cameras and
 * materials. Points of PLY and glTF are spheres or discs, lines capsules. Its meshes are nodes of glTF that place
 * triangles, groups of OBJ, else the whole; ballot_scene_mesh() tells their names. If some are kept once
 * (options->instances) the scene has instances, which number the triangles as if each use were a copy of its own. The
 * tree is kept on disk if options is NULL or options->cache is 1. Files that it names lie in its folder or below,
 * unless options->allow_outside is 1; what memory cannot hold is refused beforehand. */
BALLOT_API BallotStatus ballot_scene_load(BallotDevice* device, const char* path, const BallotSceneOptions* options,
                                          BallotScene** scene);
/* Destroys a scene. */
BALLOT_API void ballot_scene_destroy(BallotScene* scene);

/* Edits of a scene gather until ballot_scene_commit() makes all of them true at once. If it fails, the scene is as it
 * was. The edits are gone either way. Until then every answer is by the scene as it was committed last, and other
 * threads may ask. Calls for edits that are refused add nothing to them. Meshes and instances are named by their
 * numbers, which stay; a number is given once. Scenes with animations refuse edits: ballot_scene_set_time() moves them.
 * */

/* Adds a mesh and writes its number. It has no instance yet. An id of 2^32 - 1 stands for that number. The triangles of
 * arrays on the device are checked there, and stay there as those of ballot_scene_create() do. */
BALLOT_API BallotStatus ballot_scene_add_mesh(BallotScene* scene, const BallotMesh* mesh, uint32_t* number);
/* Gives a mesh other triangles and attributes, any number of them. It keeps its instances, name and id. */
BALLOT_API BallotStatus ballot_scene_replace_mesh(BallotScene* scene, uint32_t mesh, const BallotMesh* with);
/* Removes a mesh and its instances. */
BALLOT_API BallotStatus ballot_scene_remove_mesh(BallotScene* scene, uint32_t mesh);
/* Moves the vertices of a mesh, in its own space: `count` must be its vertex_count. Of a mesh from a file they are the
 * corners of its triangles, three each. BallotSceneOptions::updates says how its tree follows. The array is read by
 * ballot_scene_commit(): keep it until then. stride is in bytes; 0: 12. Once a mesh has moved the scene keeps 36 bytes
 * a triangle for the next time, of the device if the tree was built there, else of the host. */
BALLOT_API BallotStatus ballot_scene_set_vertices(BallotScene* scene, uint32_t mesh, const float* positions,
                                                  size_t count, size_t stride);
/* The same in double, read by the call. stride 0: 24. */
BALLOT_API BallotStatus ballot_scene_set_vertices_double(BallotScene* scene, uint32_t mesh, const double* positions,
                                                         size_t count, size_t stride);
/* Moves a mesh of heights, as ballot_scene_set_vertices() moves others: `count` heights, read by the call. Where others
 * are NaN than before its tree is built anew. stride 0: 4. */
BALLOT_API BallotStatus ballot_scene_set_heights(BallotScene* scene, uint32_t mesh, const float* heights, size_t count,
                                                 size_t stride);
/* Gives a mesh an attribute, in the place of one of this name that it has. No tree changes. */
BALLOT_API BallotStatus ballot_scene_set_attribute(BallotScene* scene, uint32_t mesh, const BallotAttribute* attribute);
/* Adds instances of meshes and writes the number of each; numbers may be NULL. */
BALLOT_API BallotStatus ballot_scene_add_instances(BallotScene* scene, const BallotInstances* instances,
                                                   uint32_t* numbers);
/* Removes instances, named by their numbers. */
BALLOT_API BallotStatus ballot_scene_remove_instances(BallotScene* scene, const uint32_t* instances, size_t count);
/* Moves instances: a matrix for each, as in BallotInstances. instances NULL: all of them, in the order of their
 * numbers; the array is then read by ballot_scene_commit(): keep it until then. A mesh that lay in a tree with others
 * gets its own. The tree over the instances is refitted, or built anew once refits have raised its cost by a quarter;
 * the trees of the meshes stay. stride is in bytes; 0: 48. */
BALLOT_API BallotStatus ballot_scene_set_transforms(BallotScene* scene, const uint32_t* instances,
                                                    const float* transforms, size_t count, size_t stride);
/* The same in double, read by the call. stride 0: 96. */
BALLOT_API BallotStatus ballot_scene_set_transforms_double(BallotScene* scene, const uint32_t* instances,
                                                           const double* transforms, size_t count, size_t stride);
/* Sets the masks of instances. An instance of mask 0 is met by nothing. Rays leave out an instance whose mask shares
 * no bit with theirs (BallotRays::mask). */
BALLOT_API BallotStatus ballot_scene_set_masks(BallotScene* scene, const uint32_t* instances, const uint32_t* masks,
                                               size_t count);
/* Sets the groups of instances, any numbers: rays and points of a group (BallotRays::group) meet its instances and
 * those of BALLOT_SHARED alone. Thousands of groups may lie in one place, as the copies of an environment. In a scene
 * with groups each group has a part of the tree over the instances, which the host keeps. */
BALLOT_API BallotStatus ballot_scene_set_groups(BallotScene* scene, const uint32_t* instances, const uint32_t* groups,
                                                size_t count);
/* Makes the edits true. Trees of meshes that have not changed stay. Hits of later calls are those of the edited scene;
 * in "watertight" and "exact" they are the same bits whether trees were refitted or built. Does nothing without
 * edits. */
BALLOT_API BallotStatus ballot_scene_commit(BallotScene* scene);
/* Drops the edits. */
BALLOT_API BallotStatus ballot_scene_discard(BallotScene* scene);

/* An instance of a mesh. */
typedef struct BallotInstanceInfo {
  BALLOT_SIZE(BallotInstanceInfo);
  char name[256];      /* of its node in the file, else of its mesh; cut off if it is longer */
  uint32_t id;         /* its node in the file, as BallotSceneOptions::ids "node"; else its own number */
  uint32_t mesh;       /* the number of its mesh */
  uint64_t first;      /* its triangles are prim first to first + triangles - 1 */
  uint64_t triangles;  /* how many it has */
  float transform[12]; /* 3 x 4, row by row, as in BallotInstances */
  float lo[3];         /* a box in the world that holds it; zero if it has no triangle */
  float hi[3];         /* its other end */
  uint32_t instance;   /* its number */
  uint32_t mask;       /* as ballot_scene_set_masks() says */
  uint32_t group;      /* as ballot_scene_set_groups() says */
} BallotInstanceInfo;
/* Tells of an instance by its place among them, 0 to BallotSceneInfo::instances - 1; they are in the order of their
 * numbers. */
BALLOT_API BallotStatus ballot_scene_instance(BallotScene* scene, size_t place, BallotInstanceInfo* info);

/* An animation of a scene file. */
typedef struct BallotAnimationInfo {
  BALLOT_SIZE(BallotAnimationInfo);
  char name[256];    /* cut off if it is longer */
  double seconds;    /* its times are 0 to this */
  uint64_t channels; /* number of node properties that it moves */
} BallotAnimationInfo;
/* Writes the animations of a scene, at most `room`, and their number to *count. Only glTF files have some. `infos` may
 * be NULL if room is 0. infos[0].size must be set; the others follow. */
BALLOT_API BallotStatus ballot_scene_animations(BallotScene* scene, BallotAnimationInfo* infos, size_t room,
                                                size_t* count);
/* Moves a scene to a time of one of its animations, numbered from 0: triangles, and for pictures lights and views. A
 * time outside the animation means its beginning or end. BallotSceneOptions::updates says how the tree moves; the tree
 * over meshes that are kept once moves as in ballot_scene_set_transforms(). If it fails, the scene is as it was. */
BALLOT_API BallotStatus ballot_scene_set_time(BallotScene* scene, size_t animation, double seconds);

/* What a scene holds, and its tree. */
typedef struct BallotSceneInfo {
  BALLOT_SIZE(BallotSceneInfo);
  uint64_t triangles;          /* of all meshes */
  uint64_t degenerate;         /* triangles without area; never hit */
  uint64_t meshes;             /* how many there are */
  uint64_t views;              /* how many there are */
  float lo[3];                 /* the bounds; zero if the scene is empty */
  float hi[3];                 /* their other end */
  uint64_t nodes;              /* of the tree; of all trees if there are several */
  uint64_t leaves;             /* as nodes */
  uint64_t depth;              /* of the tree; of the deepest one if there are several */
  double sah;                  /* expected cost of a random ray that meets the bounds; 0 of several trees */
  double build_seconds;        /* of the last build of the tree; of all trees if there are several */
  uint64_t instances;          /* how many there are */
  uint64_t instance_triangles; /* counted through all instances */
  double top_seconds;          /* of the last build or refit of the tree over the instances */
  double decay; /* sah divided by that at the last build: traces are slower by about this factor; 1 at a build */
  double update_seconds; /* of the last commit or change of time; 0: there was none */
  uint64_t refits;       /* such updates since the last build, which have all refitted the tree */
  uint64_t trees;        /* below the tree over the instances; 0: one tree over all, in the world */
  /* The scene's origin: the point of the world that float32 numbers are counted from: lo, hi, those of
   * BallotInstanceInfo and of ballot_scene_triangles(), and all arrays on the device. Questions, answers and edits in
   * the host's memory are of the world. Zero: there is none */
  double origin[3];
} BallotSceneInfo;
/* Tells of a scene as it was committed last. info->size must be set. */
BALLOT_API BallotStatus ballot_scene_info(BallotScene* scene, BallotSceneInfo* info);

/* A mesh of a scene. */
typedef struct BallotMeshInfo {
  BALLOT_SIZE(BallotMeshInfo);
  char name[256];      /* BallotMesh::name, or as in the file; cut off if it is longer */
  uint32_t id;         /* BallotMesh::id, or of the mesh or group in the file */
  uint64_t first;      /* number of its first triangle among those of ballot_scene_triangles() */
  uint64_t triangles;  /* how many it has */
  float lo[3];         /* its bounds, in its own space; zero if it has no triangle */
  float hi[3];         /* their other end */
  uint32_t mesh;       /* its number */
  uint32_t attributes; /* how many it has */
  double origin[3];    /* the point of its own space that lo, hi and its vertices are counted from */
  double rounding;     /* how far float32 has moved a vertex at most, as the mesh was given last; scene units */
  char shapes[16];     /* what it is made of: BallotMesh::shapes */
  uint64_t columns;    /* of heights: samples of a row; else 0, as those that follow */
  double spacing[2];   /* as BallotMesh::spacing */
  double corner[2];    /* as BallotMesh::corner */
} BallotMeshInfo;
/* Tells of a mesh by its place among them, 0 to BallotSceneInfo::meshes - 1; they are in the order of their numbers. */
BALLOT_API BallotStatus ballot_scene_mesh(BallotScene* scene, size_t place, BallotMeshInfo* info);

/* Writes the numbers of the meshes of this name, at most `room`, in ascending order, and how many there are to *count.
 * `meshes` may be NULL if room is 0. */
BALLOT_API BallotStatus ballot_scene_find_meshes(BallotScene* scene, const char* name, uint32_t* meshes, size_t room,
                                                 size_t* count);

/* An attribute of a mesh, as it was committed last. */
typedef struct BallotAttributeInfo {
  BALLOT_SIZE(BallotAttributeInfo);
  char name[256];      /* BallotAttribute::name */
  uint32_t of;         /* BALLOT_OF_VERTICES, BALLOT_OF_PRIMS or BALLOT_OF_MESH */
  uint32_t components; /* numbers of a value */
  uint64_t count;      /* number of values */
  BallotBool nearest;  /* BallotAttribute::nearest */
} BallotAttributeInfo;
/* Tells of an attribute of a mesh, named by its number, by its place among them, 0 to BallotMeshInfo::attributes - 1;
 * they are in the order in which they were given. */
BALLOT_API BallotStatus ballot_scene_attribute(BallotScene* scene, uint32_t mesh, size_t place,
                                               BallotAttributeInfo* info);
/* Writes the values of such an attribute, side by side: components * count floats. */
BALLOT_API BallotStatus ballot_scene_attribute_values(BallotScene* scene, uint32_t mesh, size_t place, float* values);

/* Writes nine floats for each triangle of each mesh: x, y, z of its three vertices, in the mesh's own space. */
BALLOT_API BallotStatus ballot_scene_triangles(BallotScene* scene, float* triangles);
/* Writes the indices that a mesh, named by its number, was made with, at most `room`, and their number to *count: three
 * for each of its triangles, or 0 if it was made without. `indices` may be NULL if room is 0. */
BALLOT_API BallotStatus ballot_scene_indices(BallotScene* scene, uint32_t mesh, uint32_t* indices, size_t room,
                                             size_t* count);
/* Writes the heights of a mesh of these, named by its number, as it was committed last: as many as its samples, NaN
 * where there is none. */
BALLOT_API BallotStatus ballot_scene_heights(BallotScene* scene, uint32_t mesh, float* heights);
/* Returns the text of the scene's last failed call. */
BALLOT_API const char* ballot_scene_error(BallotScene* scene);

#endif
