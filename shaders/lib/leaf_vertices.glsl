// Leaf format of triangles by their vertices (LEAVES_VERTICES in shared/layout.h).

struct Corners {
  vec3 v0, v1, v2;
};

Corners corners_of(TriangleTexels triangle) {
  return Corners(uintBitsToFloat(triangle.a.xyz), uintBitsToFloat(triangle.b.xyz), uintBitsToFloat(triangle.c.xyz));
}

// The prim lies beside the first vertex, so a hit holds it from the start. Times as fast as looking it up, sponza and conference
// on lavapipe 22.3.6, which executes what it branches around: packet-wide 1.22, while-while 1.03.
uint triangle_place(TriangleTexels triangle, uint block, uint i) { return triangle.a.w; }
uint prim_at(uint place) { return place; }
