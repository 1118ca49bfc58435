#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Adds the radiance of finished paths to the film. The samples of a pixel are added in order, so that sums do not
// depend on how many paths a wave holds. With BALLOT_MOMENTS it also updates the sum of squared differences from the
// mean (Youngs, Cramer, Some Results Relevant to Choice of Sum and Sum-of-Product Algorithms, Technometrics 1971).
#include "../shared/render.h"
#include "../lib/frame/records.glsl"

#ifndef BALLOT_MOMENTS
#error a variant must give BALLOT_MOMENTS
#endif

layout(local_size_x = PASS_GROUP) in;
layout(push_constant, scalar) uniform Push { FilmPush push; };
RECORDS_IN(BIND_PATHS, Paths, paths)
layout(set = 0, binding = BIND_FILM, scalar) buffer Film { FilmPixel film[]; };
#if BALLOT_MOMENTS
layout(set = 0, binding = BIND_MOMENTS, scalar) buffer Moments { vec3 moments[]; };
#endif

void main() {
  uint pixel = gl_GlobalInvocationID.x;
  if (pixel >= push.places) return;
  uint place = push.first + pixel;
  precise vec3 sum = film[place].color;
  float alpha = film[place].alpha;
#if BALLOT_MOMENTS
  precise vec3 moment = push.first_sample == 0u ? vec3(0.0) : moments[place];
#endif
  for (uint s = 0u; s < push.samples; ++s) {
    Path path = get_path(paths, pixel * push.samples + s);
    precise vec3 radiance = path.radiance;
    float peak = max(max(radiance.r, radiance.g), radiance.b);
    if (peak > push.most) radiance *= push.most / peak;
    sum += radiance;
    alpha += float(path.hit);
#if BALLOT_MOMENTS
    float n = float(push.first_sample + s + 1u);
    if (n > 1.0) {
      precise vec3 off = n * radiance - sum;
      moment += off * off / (n * (n - 1.0));
    }
#endif
  }
  film[place].color = sum;
  film[place].alpha = alpha;
#if BALLOT_MOMENTS
  moments[place] = moment;
#endif
}
