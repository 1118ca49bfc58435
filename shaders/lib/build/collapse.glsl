// What the passes share that collapse a tree of pairs into nodes of up to BALLOT_WIDTH children, 4 or 8, as
// engine/tree/formats/collapse.h does on the host, with the same choices. The pairs lie in LAYOUT_INTERLEAVED.
//
// Henri Ylitie, Tero Karras, Samuli Laine. Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs. HPG
// 2017, section 3.1.
//
// A wide node is a pair whose subtree is cut into at most BALLOT_WIDTH children: leaves, and pairs that are wide nodes
// themselves.
const uint WIDTH = BALLOT_WIDTH;

// The choice of a pair. Bits 0 to 20 hold three bits for each n from 2 on: of n children that the pair becomes, how
// many are the left sibling's. Bits 24 on hold a bit for each n from 1 on. It is set if a pair that may become up to n
// children becomes n, and clear if it becomes fewer. The pair becomes 1 child where it is a wide node.
#ifndef CHOICES_ACCESS
#define CHOICES_ACCESS readonly
#endif
layout(set = 0, binding = BIND_BUILD_CHOICES, std430) CHOICES_ACCESS buffer Choices { uint choices[]; };

uint choose_left(uint left, uint n) { return left << 3u * (n - 2u); }
uint choose_to_become(uint n) { return 1u << (23u + n); }
uint left_of(uint choice, uint n) { return choice >> 3u * (n - 2u) & 7u; }
uint becomes(uint choice, uint most) { return uint(findMSB(choice >> 24 & (1u << most) - 1u)) + 1u; }

uint pair_at(uint ref) { return ref / PAIR_TEXELS(LAYOUT_INTERLEAVED); }
uint texel_of(uint pair) { return pair * PAIR_TEXELS(LAYOUT_INTERLEAVED); }
