// The material of a surface at a hit, with textures if the scene has them.
//
// A variant gives BALLOT_HAS_<what> for each of MATERIALS (whether any material is read at all), NORMALS, GLOSS, GLASS,
// EMISSION, UNLIT, ALPHA, COLORS, BASE_TEXTURE, SURFACE_TEXTURE, EMISSIVE_TEXTURE, NORMAL_TEXTURE
// (engine/render/data/scene_data.cpp). A feature that is 0 has no code and no binding.

#define HAS_TEXTURES                                                                       \
  (BALLOT_HAS_BASE_TEXTURE || BALLOT_HAS_SURFACE_TEXTURE || BALLOT_HAS_EMISSIVE_TEXTURE || \
   BALLOT_HAS_NORMAL_TEXTURE)

#if BALLOT_HAS_MATERIALS
layout(set = 0, binding = BIND_MATERIALS, scalar) readonly buffer Materials { GpuMaterial materials[]; };
#endif
#if BALLOT_HAS_NORMALS
SCENE_ARRAY(normals, BIND_NORMALS)
#endif
#if BALLOT_HAS_COLORS
SCENE_ARRAY(colors, BIND_COLORS)
#endif
#if HAS_TEXTURES
#include "texture.glsl"
#endif

uint material_of(uint prim) { return SCENE_TEXEL(triangles, PLACE_OF(prim) * 3u).w; }

#if BALLOT_HAS_MATERIALS
// The material and the shading normal at a hit.
struct Look {
  GpuMaterial m;   // multiplied by its textures
  vec3 normal;     // shading normal: unit, on the side that the ray came from
};
#endif

#if HAS_TEXTURES
// Returns the square root of twice the triangle's area. The edges are scaled, because the product of small edges
// underflows.
float root_of_area(vec3 v0, vec3 v1, vec3 v2) {
  vec3 a = v1 - v0, b = v2 - v0;
  float scale = max(max(max(abs(a.x), abs(a.y)), abs(a.z)), max(max(abs(b.x), abs(b.y)), max(abs(b.z), 1e-30)));
  return scale * sqrt(length(cross(a / scale, b / scale)));
}

// Returns the cone's width on the surface over the square root of twice the triangle's area.
float footprint_on(vec3 v0, vec3 v1, vec3 v2, float width, float cosine) {
  return width / max(max(cosine, 0.05) * root_of_area(v0, v1, v2), 1e-30);
}
#endif

#if BALLOT_HAS_BASE_TEXTURE
vec4 base_texture(uint material, Hit hit, float footprint) {
  GpuTextureUse use = texture_uses[material * USES_PER_MATERIAL + USE_BASE];
  return use.texture == NO_TEXTURE ? vec4(1.0) : sample_use(use, corners_of(use, hit.prim), hit.u, hit.v, footprint);
}
#endif

#if BALLOT_HAS_COLORS
vec4 half_color(uvec2 words) { return vec4(unpackHalf2x16(words.x), unpackHalf2x16(words.y)); }

// Returns the interpolated colour of the vertices; exactly their colour if that is one.
vec4 vertex_color(Hit hit) {
  uvec4 two = SCENE_TEXEL(colors, 2u * PLACE_OF(hit.prim));
  uvec2 last = SCENE_TEXEL(colors, 2u * PLACE_OF(hit.prim) + 1u).xy;
  vec4 first = half_color(two.xy);
  return first + (half_color(two.zw) - first) * hit.u + (half_color(last) - first) * hit.v;
}
#endif

#if BALLOT_HAS_MATERIALS
// Returns the share of rays that a surface stops. A masked surface stops all or none.
float opacity(uint material, Hit hit) {
  GpuMaterial m = materials[material];
  if ((m.flags & (MATERIAL_ALPHA_MASK | MATERIAL_ALPHA_BLEND)) == 0u) return 1.0;
  float alpha = m.alpha;
#if BALLOT_HAS_BASE_TEXTURE
  alpha *= base_texture(material, hit, 0.0).a;
#endif
#if BALLOT_HAS_COLORS
  alpha *= vertex_color(hit).a;
#endif
  return (m.flags & MATERIAL_ALPHA_MASK) == 0u ? alpha : alpha < m.alpha_cutoff ? 0.0 : 1.0;
}
#endif

#if BALLOT_HAS_NORMAL_TEXTURE
// Returns the shading normal of a normal map. The tangents follow the triangle's own texture coordinates.
vec3 bumped(uint material, Hit hit, vec3 v0, vec3 v1, vec3 v2, vec3 n, bool front, float footprint) {
  GpuTextureUse use = texture_uses[material * USES_PER_MATERIAL + USE_NORMAL];
  if (use.texture == NO_TEXTURE) return n;
  UvCorners at = corners_of(use, hit.prim);
  vec2 d1 = at.b - at.a, d2 = at.c - at.a;
  float turn = d1.x * d2.y - d1.y * d2.x;
  if (abs(turn) < 1e-20) return n;
  vec3 tangent = ((v1 - v0) * d2.y - (v2 - v0) * d1.y) / turn,
       bitangent = ((v1 - v0) * -d2.x + (v2 - v0) * d1.x) / turn;
  vec3 outward = front ? n : -n;
  tangent -= outward * dot(outward, tangent);
  if (dot(tangent, tangent) < 1e-30) return n;
  tangent = normalize(tangent);
  // v grows downwards in images, upwards in normal maps.
  vec3 side = cross(outward, tangent) * (dot(cross(outward, tangent), bitangent) > 0.0 ? -1.0 : 1.0);
  vec3 map = sample_use(use, at, hit.u, hit.v, footprint).xyz * 2.0 - 1.0;
  vec3 bent = normalize(tangent * map.x * use.scale + side * map.y * use.scale + outward * max(map.z, 0.01));
  return front ? bent : -bent;
}
#endif

// Returns the interpolated normal on the side of n, the geometric normal on the ray's side. At a rim, the interpolated
// normal may still face away from the ray.
vec3 smooth_normal(Hit hit, vec3 n) {
#if BALLOT_HAS_NORMALS
#if BALLOT_HAS_SHAPES
  if (placed.shapes) return n;
#endif
  vec3 n0 = moved_normal(uintBitsToFloat(SCENE_TEXEL(normals, PLACE_OF(hit.prim) * 3u).xyz));
  vec3 n1 = moved_normal(uintBitsToFloat(SCENE_TEXEL(normals, PLACE_OF(hit.prim) * 3u + 1u).xyz));
  vec3 n2 = moved_normal(uintBitsToFloat(SCENE_TEXEL(normals, PLACE_OF(hit.prim) * 3u + 2u).xyz));
  vec3 smooth_n = n0 * (1.0 - hit.u - hit.v) + n1 * hit.u + n2 * hit.v;
  if (dot(smooth_n, smooth_n) > 1e-12) n = normalize(dot(smooth_n, n) < 0.0 ? -smooth_n : smooth_n);
#endif
  return n;
}

#if BALLOT_HAS_MATERIALS
// Returns the material and shading normal of a hit of material `material` on triangle v0 v1 v2. n is the triangle's
// geometric normal on the ray's side, and `width` the width of the ray's cone there.
Look look_at(Hit hit, uint material, vec3 v0, vec3 v1, vec3 v2, vec3 n, bool front, vec3 dir, float width) {
  Look look;
  look.m = materials[material];
  look.normal = smooth_normal(hit, n);
#if HAS_TEXTURES
  float footprint = footprint_on(v0, v1, v2, width, abs(dot(n, dir)));
#endif
#if BALLOT_HAS_BASE_TEXTURE
  vec4 base = base_texture(material, hit, footprint);
  look.m.base_color *= base.rgb;
  look.m.alpha *= base.a;
#endif
#if BALLOT_HAS_COLORS
  vec4 tint = vertex_color(hit);
  look.m.base_color *= tint.rgb;
  look.m.alpha *= tint.a;
#endif
#if BALLOT_HAS_SURFACE_TEXTURE
  GpuTextureUse surface = texture_uses[material * USES_PER_MATERIAL + USE_SURFACE];
  if (surface.texture != NO_TEXTURE) {
    vec2 rough_metal = sample_use(surface, corners_of(surface, hit.prim), hit.u, hit.v, footprint).gb;
    look.m.roughness *= rough_metal.x;
    look.m.metallic *= rough_metal.y;
  }
#endif
#if BALLOT_HAS_EMISSIVE_TEXTURE
  GpuTextureUse glow = texture_uses[material * USES_PER_MATERIAL + USE_EMISSIVE];
  if (glow.texture != NO_TEXTURE)
    look.m.emissive *= sample_use(glow, corners_of(glow, hit.prim), hit.u, hit.v, footprint).rgb;
#endif
#if BALLOT_HAS_NORMAL_TEXTURE
  look.normal = bumped(material, hit, v0, v1, v2, look.normal, front, footprint);
  if (dot(look.normal, dir) > -1e-3) look.normal = normalize(look.normal - (dot(look.normal, dir) + 1e-2) * dir);
#endif
  return look;
}
#endif
