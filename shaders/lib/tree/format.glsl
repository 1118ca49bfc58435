// The second tree, which a method reads in addition to the binary tree or instead of it: the eight-wide tree, the
// four-wide tree or the frontier (shared/layout.h).
#if BALLOT_FETCH == FETCH_STORAGE
layout(set = 0, binding = BIND_FORMAT, scalar) readonly buffer FormatTexels { uvec4 format_texels[]; };
uvec4 format_texel(uint texel) { return format_texels[FORMAT_AT(texel)]; }
#elif BALLOT_FETCH == FETCH_TEXEL
layout(set = 0, binding = BIND_FORMAT) uniform usamplerBuffer format_texels;
uvec4 format_texel(uint texel) { return texelFetch(format_texels, int(FORMAT_AT(texel))); }
#else
uvec4 format_texel(uint texel) { return TEXEL_AT(push.format_lo, push.format_hi, FORMAT_AT(texel)); }
#endif
