// The second tree, which a method reads in addition to the binary tree or instead of it: the wide tree, the four-wide
// tree or the frontier (shared/layout.h).
#if BALLOT_FETCH == FETCH_STORAGE
layout(set = 0, binding = BIND_TOP, scalar) readonly buffer Top { uvec4 top_texels[]; };
uvec4 top_texel(uint texel) { return top_texels[texel]; }
#elif BALLOT_FETCH == FETCH_TEXEL
layout(set = 0, binding = BIND_TOP) uniform usamplerBuffer top_texels;
uvec4 top_texel(uint texel) { return texelFetch(top_texels, int(texel)); }
#else
uvec4 top_texel(uint texel) { return Texels(uvec2(push.top_lo, push.top_hi)).at[texel]; }
#endif
