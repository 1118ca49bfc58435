// Leaf format of triangles by their vertices (LEAVES_VERTICES in shared/layout.h).

struct Corners {
  vec3 v0, v1, v2;
};

Corners fetch_corners(uint texel) {
  uvec4 a = leaf_texel(texel), b = leaf_texel(texel + 1u), c = leaf_texel(texel + 2u);
  return Corners(uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), uintBitsToFloat(c.xyz));
}

uint triangle_prim(uint block, uint i) { return leaf_texel(block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS).w; }
