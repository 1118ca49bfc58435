#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Computes a difference of products from each vec4, with lib/numeric/products.glsl.
#include "../../../shaders/shared/knobs.h"
#include "../../../shaders/lib/numeric/products.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 0, scalar) readonly buffer In { vec4 factors[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Out { float differences[]; };

void main() {
  vec4 f = factors[gl_GlobalInvocationID.x];
  differences[gl_GlobalInvocationID.x] = difference_of_products(f.x, f.y, f.z, f.w);
}
