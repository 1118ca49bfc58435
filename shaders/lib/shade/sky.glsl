// The radiance of rays that leave the scene. BALLOT_SKY is the kind of sky; a scene without a sky has no binding for
// it.
//
// Texels of BIND_SKY: (zenith, width of the map), (horizon, its height), (ground, 0). A map follows with (radiance,
// share of its row's weight up to and including this pixel) row by row, then for each row its share of all weight up to
// and including this row. Weights are luminance times solid angle.

#if BALLOT_SKY != SKY_NONE
layout(set = 0, binding = BIND_SKY) uniform usamplerBuffer sky;
const float PI_SKY = 3.14159265;

vec4 sky_texel(uint at) { return uintBitsToFloat(texelFetch(sky, int(at))); }

#if BALLOT_SKY == SKY_MAP
uvec2 map_size() { return uvec2(texelFetch(sky, 0).w, texelFetch(sky, 1).w); }

uvec2 map_pixel(vec3 d, uvec2 size) {
  vec2 at = vec2(0.5 + atan(d.x, -d.z) / (2.0 * PI_SKY), acos(clamp(d.y, -1.0, 1.0)) / PI_SKY);
  return min(uvec2(at * vec2(size)), size - 1u);
}

float row_share(uint row, uvec2 size) { return sky_texel(3u + size.x * size.y + row).x; }
float pixel_share(uvec2 p, uvec2 size) { return sky_texel(3u + p.y * size.x + p.x).w; }

// Returns the density, by solid angle, with which sample_sky picks a pixel of the map.
float map_density(uvec2 p, uvec2 size) {
  float of_row = row_share(p.y, size) - (p.y > 0u ? row_share(p.y - 1u, size) : 0.0);
  float of_pixel = pixel_share(p, size) - (p.x > 0u ? pixel_share(uvec2(p.x - 1u, p.y), size) : 0.0);
  float angle = cos(PI_SKY * float(p.y) / float(size.y)) - cos(PI_SKY * float(p.y + 1u) / float(size.y));
  return of_row * of_pixel * float(size.x) / (2.0 * PI_SKY * max(angle, 1e-12));
}

// Samples a direction in proportion to the map's luminance. `density` is by solid angle.
vec3 sample_sky(vec2 r, out vec3 radiance, out float density) {
  uvec2 size = map_size();
  uvec2 p = uvec2(0u);
  uint lo = 0u, hi = size.y - 1u;
  while (lo < hi) {
    uint mid = (lo + hi) / 2u;
    if (row_share(mid, size) > r.y) hi = mid; else lo = mid + 1u;
  }
  p.y = lo;
  float below = lo > 0u ? row_share(lo - 1u, size) : 0.0, above = row_share(lo, size);
  float fy = clamp((r.y - below) / max(above - below, 1e-12), 0.0, 1.0);
  lo = 0u, hi = size.x - 1u;
  while (lo < hi) {
    uint mid = (lo + hi) / 2u;
    if (pixel_share(uvec2(mid, p.y), size) > r.x) hi = mid; else lo = mid + 1u;
  }
  p.x = lo;
  below = lo > 0u ? pixel_share(uvec2(lo - 1u, p.y), size) : 0.0, above = pixel_share(p, size);
  float fx = clamp((r.x - below) / max(above - below, 1e-12), 0.0, 1.0);
  radiance = sky_texel(3u + p.y * size.x + p.x).rgb;
  density = map_density(p, size);
  float phi = (float(p.x) + fx - 0.5 * float(size.x)) / float(size.x) * 2.0 * PI_SKY;
  float y = mix(cos(PI_SKY * float(p.y) / float(size.y)), cos(PI_SKY * float(p.y + 1u) / float(size.y)), fy);
  float across = sqrt(max(1.0 - y * y, 0.0));
  return vec3(across * sin(phi), y, -across * cos(phi));
}
#endif

// Returns the radiance from a unit direction. The same as Sky::radiance (engine/model/sky.cpp).
vec3 sky_radiance(vec3 d) {
#if BALLOT_SKY == SKY_CONSTANT
  return sky_texel(0u).rgb;
#elif BALLOT_SKY == SKY_GRADIENT
  return d.y >= 0.0 ? mix(sky_texel(1u).rgb, sky_texel(0u).rgb, sqrt(d.y)) : sky_texel(2u).rgb;
#else
  uvec2 size = map_size(), p = map_pixel(d, size);
  return sky_texel(3u + p.y * size.x + p.x).rgb;
#endif
}
#endif
