// Leaf format of triangles by their vertices (LEAVES_VERTICES in shared/layout.h).

struct Corners {
  vec3 v0, v1, v2;
};

Corners corners_of(TriangleTexels triangle) {
  return Corners(uintBitsToFloat(triangle.a.xyz), uintBitsToFloat(triangle.b.xyz), uintBitsToFloat(triangle.c.xyz));
}

uint triangle_prim(uint block, uint i) { return leaf_texel(block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS).w; }
