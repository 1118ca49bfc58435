// Light sampling: emissive triangles, punctual lights and the sky. A sample picks one of the kinds that the scene has,
// each with the same probability. BALLOT_HAS_EMISSION, BALLOT_HAS_LIGHTS and BALLOT_SKY say which kinds there are; a
// scene without any has none of this code.

// A plain sky is left to BSDF sampling where that finds light (lib/path/direct_light.glsl).
#define AIMS_AT_SKY (BALLOT_SKY == SKY_MAP || (BALLOT_SKY != SKY_NONE && !BSDF_FINDS_LIGHT))
#define LIGHT_KINDS (BALLOT_HAS_EMISSION + BALLOT_HAS_LIGHTS + AIMS_AT_SKY)
#define HAS_LIGHT (BALLOT_HAS_EMISSION || BALLOT_HAS_LIGHTS || AIMS_AT_SKY)

const float INFINITELY_FAR = 1e30;

// A sample of light.
struct Aim {
  vec3 dir;        // unit, from the surface; zero: there is nothing to sample
  float distance;  // scene units; at least INFINITELY_FAR: `end` is not set
  vec3 end;        // where a ray to the light may end, off its surface
  vec3 radiance;   // divided by the density or probability
  float density;   // of this direction by solid angle; 0: no other sampling finds it
};

#define NO_AIM Aim(vec3(0.0), 0.0, vec3(0.0), vec3(0.0), 0.0)

#if HAS_LIGHT
// The kernel may have code for kinds that this scene lacks. It must not sample those.
#if LIGHT_KINDS == 1
#define KIND_CHANCE 1.0
#else
uint light_kinds() {
  uint kinds = 0u;
#if BALLOT_HAS_EMISSION
  kinds += uint(push.emitters != 0u);
#endif
#if BALLOT_HAS_LIGHTS
  kinds += uint(push.lights != 0u);
#endif
#if AIMS_AT_SKY
  kinds += push.sky;
#endif
  return kinds;
}
#define KIND_CHANCE (1.0 / float(max(light_kinds(), 1u)))
#endif

#if BALLOT_HAS_EMISSION
layout(set = 0, binding = BIND_EMITTERS) uniform usamplerBuffer emitters;

// Returns the density with which light sampling picks a point of an emissive triangle. Triangles are picked in
// proportion to area and emission, points of a triangle uniformly.
float emission_density(float emitted, float distance, float cosine) {
  return KIND_CHANCE * emitted / push.emitted * distance * distance / max(abs(cosine), 1e-6);
}

Aim aim_at_triangle(vec3 from, float pick, vec2 r) {
  if (push.emitters == 0u) return NO_AIM;  // no emissive triangle has an area
  uint lo = 0u, hi = push.emitters - 1u;
  float wanted = pick * push.emitted;
  while (lo < hi) {
    uint mid = (lo + hi) / 2u;
    if (uintBitsToFloat(texelFetch(emitters, int(mid)).y) > wanted) hi = mid; else lo = mid + 1u;
  }
  uint prim = texelFetch(emitters, int(lo)).x;
  float root = sqrt(r.x);
  Hit hit = Hit(0.0, prim, root * (1.0 - r.y), root * r.y);
  Surface light = surface_at(hit);
  vec3 to = light.position - from;
  Aim aim;
  aim.distance = length(to);
  aim.dir = to / max(aim.distance, 1e-30);
  float towards = dot(light.normal, aim.dir), cosine = abs(towards);
  aim.end = origin_on(light, towards > 0.0 ? -1.0 : 1.0);
  uint material = material_of(prim);
  vec3 radiance = materials[material].emissive;
#if BALLOT_HAS_EMISSIVE_TEXTURE
  GpuTextureUse glow = texture_uses[material * USES_PER_MATERIAL + USE_EMISSIVE];
  if (glow.texture != NO_TEXTURE) radiance *= sample_use(glow, corners_of(glow, prim), hit.u, hit.v, 0.0).rgb;
#endif
#if BALLOT_HAS_ALPHA
  radiance *= opacity(material, hit);  // BSDF samples pass through the transparent part
#endif
  aim.density = emission_density(materials[material].emitted, aim.distance, cosine);
  aim.radiance = cosine > 1e-6 && aim.distance > 0.0 ? radiance / aim.density : vec3(0.0);
  return aim;
}
#endif

#if BALLOT_HAS_LIGHTS
layout(set = 0, binding = BIND_LIGHTS, scalar) readonly buffer Lights { GpuLight lights[]; };

Aim aim_at_light(vec3 from, float pick) {
  GpuLight light = lights[min(uint(pick * float(push.lights)), push.lights - 1u)];
  Aim aim;
  aim.density = 0.0;
  aim.radiance = light.intensity * (float(push.lights) / KIND_CHANCE);
  if (light.kind == LIGHT_DIRECTIONAL) {
    aim.dir = -light.direction;
    aim.distance = INFINITELY_FAR;
    return aim;
  }
  aim.end = light.position;
  vec3 to = light.position - from;
  aim.distance = max(length(to), 1e-30);
  aim.dir = to / aim.distance;
  aim.radiance /= aim.distance * aim.distance;
  if (light.range > 0.0) {
    float share = aim.distance / light.range;
    aim.radiance *= clamp(1.0 - share * share * share * share, 0.0, 1.0);
  }
  if (light.kind == LIGHT_SPOT) {
    float within = clamp(
        (dot(-aim.dir, light.direction) - light.cos_outer) / max(light.cos_inner - light.cos_outer, 1e-3), 0.0, 1.0);
    aim.radiance *= within * within;
  }
  return aim;
}
#endif

#if AIMS_AT_SKY
Aim aim_at_sky(vec3 n, vec2 r) {
  Aim aim;
  aim.distance = INFINITELY_FAR;
#if BALLOT_SKY == SKY_MAP
  aim.dir = sample_sky(r, aim.radiance, aim.density);
  aim.density *= KIND_CHANCE;
#else
  aim.dir = cosine_about(n, r);
  aim.radiance = sky_radiance(aim.dir);
  aim.density = KIND_CHANCE * max(dot(n, aim.dir), 0.0) / PI;
#endif
  aim.radiance = aim.density > 0.0 ? aim.radiance / aim.density : vec3(0.0);
  return aim;
}
#endif

// Samples light for the point `from` with shading normal n.
Aim aim_at_something(vec3 from, vec3 n, float pick, vec2 r) {
#if LIGHT_KINDS == 1
#if BALLOT_HAS_EMISSION
  return aim_at_triangle(from, pick, r);
#elif BALLOT_HAS_LIGHTS
  return aim_at_light(from, pick);
#else
  return aim_at_sky(n, r);
#endif
#else
  uint kinds = light_kinds();
  if (kinds == 0u) return NO_AIM;
  float at = pick * float(kinds);
  uint kind = min(uint(at), kinds - 1u);
  float rest = at - float(kind);
#if BALLOT_HAS_EMISSION
  if (push.emitters != 0u && kind == 0u) return aim_at_triangle(from, rest, r);
  kind -= uint(push.emitters != 0u);
#endif
#if BALLOT_HAS_LIGHTS
  if (push.lights != 0u && kind == 0u) return aim_at_light(from, rest);
#endif
#if AIMS_AT_SKY
  return aim_at_sky(n, r);
#else
  return NO_AIM;
#endif
#endif
}
#endif
