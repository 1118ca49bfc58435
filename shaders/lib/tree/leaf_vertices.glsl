// Leaf format of triangles by their vertices (LEAVES_VERTICES in shared/layout.h).

struct Corners {
  vec3 v0, v1, v2;
};

Corners corners_of(TriangleTexels triangle) {
  vec3 x = uintBitsToFloat(triangle.a.xyz), y = uintBitsToFloat(triangle.b.xyz), z = uintBitsToFloat(triangle.c.xyz);
  return Corners(vec3(x.x, y.x, z.x), vec3(x.y, y.y, z.y), vec3(x.z, y.z, z.z));
}

// The prim lies beside every coordinate, so a hit holds it from the start. Speed-up over a later look-up, sponza and
// conference on lavapipe 22.3.6, which executes both sides of branches: packet-wide 1.22, while-while 1.03.
uint triangle_place(TriangleTexels triangle, uint block, uint i) { return triangle.a.w; }
uint prim_at(uint place) { return place; }
