#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Multiplies the colour's alpha by the coverage that the atlas holds.
#include "../shared/paint.h"

layout(set = 0, binding = BIND_ATLAS) uniform sampler2D atlas;
layout(location = 0) in vec4 color;
layout(location = 1) in vec2 at;
layout(location = 0) out vec4 painted;

void main() { painted = vec4(color.rgb, color.a * texture(atlas, at).r); }
