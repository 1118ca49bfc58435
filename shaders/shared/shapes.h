// Shapes other than triangles, for C++ and GLSL: their kinds, and how their records lie in memory.
#ifndef BALLOT_SHAPES_H
#define BALLOT_SHAPES_H

// Kinds of shapes. BALLOT_SHAPES has a bit for each kind that the meshes of a scene have, BALLOT_SHAPES of 0 or 1 << 0
// none but triangles. A mesh has shapes of one kind.
#define SHAPE_TRIANGLE 0
#define SHAPE_SPHERE 1
#define SHAPE_DISC 2
#define SHAPE_CAPSULE 3
#define SHAPE_BOX 4

// A record has two texels of four floats; records of spheres alone have one.
//   sphere   (centre, radius)
//   disc     (centre, radius), (unit normal, 0)
//   capsule  (end 0, its radius), (end 1, its radius): the convex hull of two spheres, a round cone if the radii differ
//   box      (lower corner, 0), (upper corner, 0)
// BIND_SHAPES begins with a texel for each mesh: its kind, the texel of its first record, the texels of a record, 0.
// Leaves hold a triangle for each shape that stands in for it: it has the bounds of the shape.
#define BIND_SHAPES 47

#endif  // BALLOT_SHAPES_H
