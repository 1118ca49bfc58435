#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Writes one of each shared record. Its fields hold increasing numbers.
#include "../../../shaders/shared/layout.h"
#include "../../../shaders/shared/render.h"

layout(local_size_x = 1) in;
layout(set = 0, binding = 0, scalar) writeonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = 2, scalar) writeonly buffer Nodes { BvhNode nodes[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Film { FilmPixel film[]; };

void main() {
  rays[1] = Ray(vec3(1, 2, 3), 4, vec3(5, 6, 7), 8);
  hits[1] = Hit(1, 2u, 3, 4);
  nodes[1] = BvhNode(vec3(1, 2, 3), vec3(4, 5, 6), 7u, 8u);
  film[1] = FilmPixel(vec3(1, 2, 3), 4, 5, vec3(6, 7, 8), 9u);
}
