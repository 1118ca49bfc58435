/* A program of somebody else in C: an audio engine that leaves its rays to others by a table of functions, and the
 * functions over Ballot. The engine's arrays are read where they lie. */
#include <ballot/ballot_c.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- What the engine asks for ---- */
typedef struct AudioRay {
  float origin[3], direction[3];
} AudioRay;
typedef struct AudioMaterial {
  float absorption[3], scattering, transmission[3];
} AudioMaterial;
typedef struct AudioHit {
  float distance; /* infinity: nothing was hit */
  int triangle, object, material_index;
  float normal[3];
  const AudioMaterial* material;
} AudioHit;
typedef struct AudioTracer {
  void (*closest_hits)(int count, const AudioRay* rays, const float* nearest, const float* farthest, AudioHit* hits,
                       void* user);
  void (*any_hits)(int count, const AudioRay* rays, const float* nearest, const float* farthest,
                   unsigned char* occluded, void* user);
  void* user;
} AudioTracer;

/* ---- The functions ---- */
typedef struct World {
  BallotScene* scene;
  const AudioMaterial* materials; /* attribute "material" of triangles has their numbers */
  int room;                       /* rays that the arrays below hold */
  float *t, *normals, *numbers;
  uint32_t *prims, *ids;
  BallotStatus failed; /* the first failure: the engine's functions return nothing */
} World;

static BallotRays as_rays(int count, const AudioRay* rays, const float* nearest, const float* farthest) {
  BallotRays in = BALLOT_INIT(BallotRays);
  in.shape[0] = (size_t)count;
  in.origin.data = rays->origin, in.origin.stride[0] = sizeof *rays;
  in.direction.data = rays->direction, in.direction.stride[0] = sizeof *rays;
  in.t_min.data = nearest, in.t_min.stride[0] = sizeof *nearest;
  in.t_max.data = farthest, in.t_max.stride[0] = sizeof *farthest;
  return in;
}

static int make_room(World* world, int count) {
  if (count <= world->room) return 1;
  const size_t n = (size_t)count;
  world->t = realloc(world->t, n * sizeof(float)), world->normals = realloc(world->normals, 3 * n * sizeof(float));
  world->numbers = realloc(world->numbers, n * sizeof(float)), world->ids = realloc(world->ids, n * sizeof(uint32_t));
  world->prims = realloc(world->prims, n * sizeof(uint32_t));
  world->room = world->t && world->normals && world->numbers && world->prims && world->ids ? count : 0;
  return world->room;
}

static void closest_hits(int count, const AudioRay* rays, const float* nearest, const float* farthest, AudioHit* hits,
                         void* user) {
  World* world = user;
  const BallotRays in = as_rays(count, rays, nearest, farthest);
  BallotHits out = BALLOT_INIT(BallotHits);
  BallotValues number = {"material", NULL};
  const int room = make_room(world, count);
  number.data = world->numbers;
  out.t = world->t, out.prims = world->prims, out.mesh_ids = world->ids, out.normals = world->normals;
  out.values = &number, out.value_count = 1;
  const BallotStatus status = room ? ballot_trace(world->scene, &in, &out, NULL, NULL) : BALLOT_ERROR_MEMORY;
  if (status && !world->failed) world->failed = status;
  for (int i = 0; i < count; ++i) {
    const AudioHit none = {INFINITY, -1, -1, -1, {0, 0, 0}, NULL};
    hits[i] = none;
    if (status || world->prims[i] == BALLOT_MISS) continue;
    hits[i].distance = world->t[i], hits[i].triangle = (int)world->prims[i], hits[i].object = (int)world->ids[i];
    for (int k = 0; k < 3; ++k) hits[i].normal[k] = world->normals[3 * i + k];
    hits[i].material_index = (int)world->numbers[i];
    hits[i].material = world->materials + hits[i].material_index;
  }
}

static void any_hits(int count, const AudioRay* rays, const float* nearest, const float* farthest,
                     unsigned char* occluded, void* user) {
  World* world = user;
  const BallotRays in = as_rays(count, rays, nearest, farthest);
  BallotHits out = BALLOT_INIT(BallotHits);
  BallotQuery any = BALLOT_INIT(BallotQuery);
  out.occluded = occluded, any.any = 1;
  const BallotStatus status = ballot_trace(world->scene, &in, &out, &any, NULL);
  if (status && !world->failed) world->failed = status;
}

/* ---- The engine ---- */
int main(void) {
  const float corners[] = {5, -9, -9, 5, -9, 9, 5, 9, 0, -2, -9, -9, -2, 9, 0, -2, -9, 9}; /* two walls across x */
  const float numbers[] = {0, 1};
  const AudioMaterial materials[] = {{{0.1f, 0.2f, 0.3f}, 0.05f, {0, 0, 0}}, {{0.6f, 0.7f, 0.8f}, 0.5f, {0, 0, 0}}};
  const AudioRay rays[] = {{{0, 0, 0}, {1, 0, 0}}, {{0, 0, 0}, {-1, 0, 0}}, {{0, 0, 0}, {1, 0, 0}}, {{0}, {0, 1, 0}}};
  const float nearest[] = {0, 0, 0, 0}, farthest[] = {100, 100, 4, 100};
  BallotAttribute material = BALLOT_INIT(BallotAttribute);
  BallotMesh mesh = BALLOT_INIT(BallotMesh);
  BallotDevice* device = NULL;
  World world = {0};
  AudioHit hits[4];
  unsigned char occluded[4];
  material.name = "material", material.of = BALLOT_OF_PRIMS, material.count = 2, material.data = numbers;
  mesh.positions = corners, mesh.vertex_count = 6, mesh.id = 7, mesh.attributes = &material, mesh.attribute_count = 1;
  world.materials = materials;
  if (ballot_device_open(NULL, &device) || ballot_scene_create(device, &mesh, 1, NULL, NULL, &world.scene)) return 1;
  const AudioTracer tracer = {closest_hits, any_hits, &world};
  tracer.closest_hits(4, rays, nearest, farthest, hits, tracer.user);
  tracer.any_hits(4, rays, nearest, farthest, occluded, tracer.user);
  if (world.failed) return fprintf(stderr, "%s\n", ballot_scene_error(world.scene)), 2;
  printf("walls at %g and %g\n", (double)hits[0].distance, (double)hits[1].distance);
  if (hits[0].distance != 5 || hits[1].distance != 2 || hits[1].triangle != 1 || hits[0].object != 7) return 3;
  if (hits[0].material != materials || hits[1].material != materials + 1 || fabsf(hits[0].normal[0]) != 1) return 4;
  if (hits[2].material || !isinf(hits[3].distance) || !occluded[0] || !occluded[1] || occluded[2] || occluded[3])
    return 5;
  free(world.t), free(world.normals), free(world.numbers), free(world.prims), free(world.ids);
  ballot_scene_destroy(world.scene), ballot_device_close(device);
  return 0;
}
