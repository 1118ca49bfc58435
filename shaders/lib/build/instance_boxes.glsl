// Instances in place of triangles, push.triangles of them: their boxes, from the records of the top-level tree, which
// lie behind room for a node each (shaders/shared/layout.h). The file that includes this one declares push.
layout(set = 0, binding = BIND_BUILD_TRIANGLES, scalar) readonly buffer Triangles { uvec4 top_texels[]; };

struct Corners {
  vec3 a, b;  // the lower and the upper one
  float slack;
};

Corners corners_of(uint instance) {
  uint at = push.triangles * TOP_NODE_TEXELS + instance * INSTANCE_TEXELS + 3u;
  uvec4 lo = top_texels[at], hi = top_texels[at + 1u];
  return Corners(uintBitsToFloat(lo.xyz), uintBitsToFloat(hi.xyz), uintBitsToFloat(hi.w));
}

vec3 lo_of(Corners t) { return t.a; }
vec3 hi_of(Corners t) { return t.b; }
// The slack takes the place of a side: nodes keep the largest one below them, rounded up.
vec3 sides_of_corners(Corners t) { return vec3(0.0, 0.0, t.slack); }
// True if the instance is not in the tree: its mesh is empty or its transform unusable.
bool has_no_area(Corners t) { return t.slack == 0.0; }
