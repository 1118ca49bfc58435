// Records what a picture stores of the hits of camera rays.

// Writes distance, normal and prim of the first sample to the film.
void record_first(PixelSample sampled, Ray ray, Hit hit, vec3 normal) {
  FilmPixel p = FilmPixel(vec3(0.0), 0.0, 0.0, vec3(0.0), NO_HIT);
  if (hit.prim != NO_HIT) {
    p.z = hit.t * length(ray.dir);
    p.normal = normal;
    p.prim = hit.prim;
  }
  film[sampled.place] = p;
}

// Records a hit with shading normal `normal` if its ray is a camera ray. The last statement of shade_hit().
#define RECORD_FIRST_HIT(path, sampled, ray, hit, normal)                        \
  if (RAY_DEPTH == 0u) {                                                         \
    path.hit = 1u;                                                               \
    if (sampled.sample_index == 0u) record_first(sampled, ray, hit, normal);     \
  }
