// Texture sampling: bilinear, between the two nearest mip maps, with the wrap modes of the texture and the transform of
// each use.

SCENE_ARRAY(uvs, BIND_UVS)
layout(set = 0, binding = BIND_TEXELS) uniform usamplerBuffer texels;
layout(set = 0, binding = BIND_TEXTURES, scalar) readonly buffer Textures { GpuTexture textures[]; };
layout(set = 0, binding = BIND_TEXTURE_USES, scalar) readonly buffer TextureUses { GpuTextureUse texture_uses[]; };

// Texture coordinates of the three vertices, transformed by the use.
struct UvCorners {
  vec2 a, b, c;
};

vec2 transformed(GpuTextureUse use, vec2 uv) {
  return vec2(dot(use.row_u, vec3(uv, 1.0)), dot(use.row_v, vec3(uv, 1.0)));
}

UvCorners corners_of(GpuTextureUse use, uint prim) {
  vec4 ab = uintBitsToFloat(SCENE_TEXEL(uvs, use.first_uv + 2u * PLACE_OF(prim)));
  vec2 c = uintBitsToFloat(SCENE_TEXEL(uvs, use.first_uv + 2u * PLACE_OF(prim) + 1u).xy);
  return UvCorners(transformed(use, ab.xy), transformed(use, ab.zw), transformed(use, c));
}

int wrapped(int x, int size, uint mode) {
  if (mode == WRAP_CLAMP) return clamp(x, 0, size - 1);
  int period = mode == WRAP_MIRROR ? 2 * size : size;
  x -= int(floor(float(x) / float(period))) * period;
  x = clamp(x, 0, period - 1);  // the quotient was rounded
  return x < size ? x : period - 1 - x;
}

vec4 texel_at(GpuTexture t, uint first, ivec2 size, ivec2 at) {
  at.x = wrapped(at.x, size.x, t.flags & 3u);
  at.y = wrapped(at.y, size.y, t.flags >> TEXTURE_WRAP_V_SHIFT & 3u);
  uint index = first + uint(at.y * size.x + at.x);
  uvec4 two = texelFetch(texels, int(index >> 1));
  uvec2 one = (index & 1u) == 0u ? two.xy : two.zw;
  return vec4(unpackHalf2x16(one.x), unpackHalf2x16(one.y));
}

vec4 sample_level(GpuTexture t, vec2 uv, uint level) {
  uint first = t.first;
  ivec2 size = ivec2(t.width, t.height);
  for (uint l = 0u; l < level; ++l) {
    first += uint(size.x * size.y);
    size = max(size / 2, ivec2(1));
  }
  vec2 at = clamp(uv, -1e5, 1e5) * vec2(size);
  if ((t.flags & TEXTURE_NEAREST) != 0u) return texel_at(t, first, size, ivec2(floor(at)));
  at -= 0.5;
  ivec2 low = ivec2(floor(at));
  vec2 f = at - vec2(low);
  return mix(mix(texel_at(t, first, size, low), texel_at(t, first, size, low + ivec2(1, 0)), f.x),
             mix(texel_at(t, first, size, low + ivec2(0, 1)), texel_at(t, first, size, low + ivec2(1, 1)), f.x), f.y);
}

// Samples a use at the barycentric weights u, v of vertices 1 and 2. `footprint` is the width of the ray's cone on the
// surface over the square root of twice the triangle's area; 0 selects the finest level.
vec4 sample_use(GpuTextureUse use, UvCorners corners, float u, float v, float footprint) {
  GpuTexture t = textures[use.texture];
  vec2 uv = corners.a * (1.0 - u - v) + corners.b * u + corners.c * v;
  vec2 size = vec2(t.width, t.height), x = (corners.b - corners.a) * size, y = (corners.c - corners.a) * size;
  float lambda = log2(max(footprint * sqrt(abs(x.x * y.y - x.y * y.x)), 1.0));
  lambda = min(lambda, float(t.levels - 1u));
  uint level = uint(lambda);
  vec4 fine = sample_level(t, uv, level);
  float part = lambda - float(level);
  return part > 0.0 ? mix(fine, sample_level(t, uv, level + 1u), part) : fine;
}
