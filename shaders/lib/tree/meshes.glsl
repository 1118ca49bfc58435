// The arrays of two levels (shared/layout.h), and the way from the tree of one mesh to that of another.

#ifndef MESHES
#define MESHES  // once, where rays and points are asked about
#if BALLOT_FETCH == FETCH_STORAGE
layout(set = 0, binding = BIND_TOP, scalar) readonly buffer Top { uvec4 top_texels[]; };
layout(set = 0, binding = BIND_MESHES, scalar) readonly buffer Meshes { uvec4 mesh_texels[]; };
uvec4 top_texel(uint texel) { return top_texels[texel]; }
uvec4 mesh_texel(uint texel) { return mesh_texels[texel]; }
#elif BALLOT_FETCH == FETCH_TEXEL
layout(set = 0, binding = BIND_TOP) uniform usamplerBuffer top_texels;
layout(set = 0, binding = BIND_MESHES) uniform usamplerBuffer mesh_texels;
uvec4 top_texel(uint texel) { return texelFetch(top_texels, int(texel)); }
uvec4 mesh_texel(uint texel) { return texelFetch(mesh_texels, int(texel)); }
#else
uvec4 top_texel(uint texel) { return Texels(uvec2(top_push.top_lo, top_push.top_hi)).at[texel]; }
uvec4 mesh_texel(uint texel) { return Texels(uvec2(top_push.meshes_lo, top_push.meshes_hi)).at[texel]; }
#endif

// Sets what the walk of a mesh reads instead of the push constants. Returns the mesh's root.
uint enter_mesh(uint mesh) {
#if BALLOT_SHAPES
  enter_shapes(mesh);
#endif
  uvec4 a = mesh_texel(mesh * MESH_TEXELS), b = mesh_texel(mesh * MESH_TEXELS + 1u),
        c = mesh_texel(mesh * MESH_TEXELS + 2u), d = mesh_texel(mesh * MESH_TEXELS + 3u);
  push.scene_lo = uintBitsToFloat(a.xyz);
  push.padded_reach = uintBitsToFloat(a.w);
  push.scene_hi = uintBitsToFloat(b.xyz);
  push.shear_scale = uintBitsToFloat(b.w);
  push.box_origin = uintBitsToFloat(c.xyz);
  push.shear_near = uintBitsToFloat(c.w);
  first_node = d.y;
  first_leaf = d.z;
  first_format = d.w;
#if BALLOT_DOUBLES
  first_double = double_texel(mesh).x;
#endif
  return top_push.mesh_root == END_OF_TREE ? d.x : top_push.mesh_root;
}

// Returns a direction, or a point less the translation, in the space of the mesh of an instance, whose record has these
// rows.
vec3 in_object(vec4 x, vec4 y, vec4 z, vec3 v) {
  precise vec3 moved = vec3(x.x * v.x + x.y * v.y + x.z * v.z, y.x * v.x + y.y * v.y + y.z * v.z,
                            z.x * v.x + z.y * v.y + z.z * v.z);
  return moved;
}
#endif
