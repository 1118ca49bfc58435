/* A program of somebody else in C: a cube, and rays from its middle and past it. */
#include <ballot/ballot_c.h>
#include <stdio.h>

static int failed(const char* what, const char* why) {
  fprintf(stderr, "%s: %s\n", what, why);
  return 1;
}

int main(void) {
  const float vertices[8 * 3] = {-1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1};
  const uint16_t indices[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4,
                                3, 6, 2, 3, 7, 6, 1, 2, 6, 1, 6, 5, 0, 4, 7, 0, 7, 3};
  const BallotRay rays[3] = {
      {{0, 0, 0}, 0, {1, 0, 0}, 10}, {{0, 0, 0}, 0, {0, 0, -2}, 10}, {{0, 5, 0}, 0, {1, 0, 0}, 10}};
  BallotDevice* device = NULL;
  BallotScene* scene = NULL;
  BallotHit hits[3];
  BallotMesh mesh = BALLOT_INIT(BallotMesh);
  BallotRays in = ballot_rays(rays, 3);
  const double up[3] = {0, 0, 4};
  float t[3];
  BallotHits out = BALLOT_INIT(BallotHits);
  mesh.positions = vertices;
  mesh.vertex_count = 8;
  mesh.indices = indices;
  mesh.index_count = 36;
  mesh.index_type = BALLOT_INDEX_U16;
  if (ballot_device_open(NULL, &device)) return failed("opening the device", ballot_last_error());
  if (ballot_scene_create(device, &mesh, 1, NULL, NULL, &scene))
    return failed("making the scene", ballot_device_error(device));
  out.hits = hits;
  if (ballot_trace(scene, &in, &out, NULL, NULL)) return failed("tracing", ballot_scene_error(scene));
  printf("ballot %s: t = %g, %g; misses: %d\n", ballot_version(), (double)hits[0].t, (double)hits[1].t,
         hits[2].prim == BALLOT_MISS);
  if (hits[0].t != 1 || hits[1].t != 0.5f || hits[2].prim != BALLOT_MISS) return failed("hits", "they are wrong");
  in.direction.data = up, in.direction.stride[0] = 0, in.direction.type = BALLOT_FLOAT64; /* one for all, in double */
  out.hits = NULL;
  out.t = t;
  if (ballot_trace(scene, &in, &out, NULL, NULL)) return failed("tracing columns", ballot_scene_error(scene));
  if (t[0] != 0.25f || t[1] != 0.25f || t[2] < 1e30f) return failed("hits of columns", "they are wrong");
  mesh.index_count = 35;
  if (ballot_scene_create(device, &mesh, 1, NULL, NULL, &scene) != BALLOT_ERROR_ARGUMENT)
    return failed("35 indices", "taken");
  ballot_scene_destroy(scene);
  ballot_device_close(device);
  return ballot_trace(scene, &in, &out, NULL, NULL) == BALLOT_ERROR_CLOSED ? 0 : failed("a closed scene", "was used");
}
