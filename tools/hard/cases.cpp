// The registry of hard cases, a line each, and of scenes that must be refused.
#include "tools/hard/generate.h"

namespace ballot {
namespace {

using namespace hard;

constexpr HardCase kCases[] = {
    // Directions and faces of boxes.
    {"axis-directions", "madmann91/bvh #9, #20; tinybvh #282, #286",
     "0 and -0 components give NaN or a swapped interval in the slab test", axis_directions},
    {"box-faces", "warp #1530; Embree #589",
     "an origin on a face of a box and a direction along it multiply 0 by infinity", box_faces},
    {"denormal-directions", "madmann91/bvh #21",
     "reciprocals of denormal components overflow, or denormals slow arithmetic down", denormal_directions},
    {"direction-lengths", "Embree, verify; Ballot, design", "epsilons assume directions of unit length",
     direction_lengths},
    {"short-directions", "Ballot, design",
     "the reciprocal of a short direction reaches the limit that guards against infinity", short_directions},
    {"long-directions", "Ballot, design", "the reciprocal of a long direction is denormal and may be flushed to zero",
     long_directions},
    // Closed meshes.
    {"icosphere", "Woop, Benthin, Wald. Watertight Ray/Triangle Intersection. JCGT 2013",
     "a ray at a shared edge or vertex slips between the triangles", closed_icosphere},
    {"cube-grid", "Embree, verify (watertight)", "flat boxes and edges that rays meet exactly", closed_cube},
    {"far-sphere-and-plane", "Embree, verify (verify.cpp:6557)",
     "far from the origin of coordinates rounding errors open gaps", far_sphere_and_plane},
    {"quantised-statue", "tinybvh #168",
     "a regular grid of rays meets the edges of a mesh on integer coordinates exactly", quantised_statue},
    {"collapsed-statue", "tinybvh #168", "triangles that quantisation made collinear leave cracks behind",
     collapsed_statue},
    {"two-shells", "Mitsuba 3 #1871", "the farther of two surfaces 4e-5 apart is reported", two_shells},
    {"rough-spheres", "pbrt-v4, shapes_test.cpp (Triangle.Watertight)",
     "rays at, and one ulp beside, vertices where triangles of all slopes meet", rough_spheres},
    // Closed meshes that touch and enclose each other.
    {"touching-shells", "Ballot, design",
     "an edge, a vertex or a face that surfaces have in common is crossed twice or not at all", touching_shells},
    {"far-shells", "Ballot, design", "nested surfaces at 1e7 are crossed in another order, or not at all", far_shells},
    {"sliver-shells", "Ballot, design", "rays from outside cross a flattened closed mesh once or three times",
     sliver_shells},
    // Scales and places.
    {"tiny-spheres", "Embree, verify (small triangles)",
     "products of small edges underflow, and the triangle is missed", tiny_spheres},
    {"tiny-in-huge", "Embree, verify (small triangles)",
     "a tolerance that grows with the scene swallows its small objects", tiny_in_huge},
    {"huge-sphere", "Embree #416", "products of long edges overflow", huge_sphere},
    {"huge-planes", "Embree #416", "planes with half widths of 5.9e8 to 5.9e11 are missed from nearby", huge_planes},
    {"far-offsets", "three-mesh-bvh #112; Accelerad #4", "meshes at 1e5, 4.5e6 and 6e6 leak", far_offsets},
    {"utm-terrain", "Accelerad #4", "terrain in map coordinates, whose float32 spacing is half a metre", utm_terrain},
    {"narrow-view", "Mitsuba 3 #61", "directions of a distant camera with a narrow view differ by few ulp",
     narrow_view},
    // Shapes.
    {"flat-walls", "Ballot, design", "the box of an axis-parallel triangle has an interval of length 0", flat_walls},
    {"needles", "Embree, verify (sliver triangles)", "rounding flips the sign of a sliver's edge functions", needles},
    {"hairs", "Ballot, design",
     "a triangle narrower than 1e-16 of its length is taken for one without area, and is missed", hairs},
    {"thin-triangle", "Embree #387", "a thin triangle is missed by rays at 0.52 degrees to its plane", thin_triangle},
    {"grazing", "Embree #387; pbrt-v4, shapes_test.cpp", "rays in the plane of a triangle, or an ulp off it", grazing},
    {"duplicates", "Ballot, design", "among coincident triangles the first one that the traversal met is reported",
     duplicates},
    {"coplanar-overlaps", "Ballot, design",
     "the answer among overlapping triangles of one plane depends on the traversal order", coplanar_overlaps},
    {"interpenetrating", "Ballot, design", "surfaces that cross are reported in the wrong order near the crossing",
     interpenetrating},
    // Trees.
    {"chain", "tinybvh #192", "a tree that is one long chain overflows the stack", chain},
    {"same-box", "svenstaro/bvh #44", "triangles with equal boxes cannot be split", same_box},
    {"same-centroid", "svenstaro/bvh #44", "triangles with equal centroids cannot be split", same_centroid},
    {"degenerate-among-proper", "svenstaro/bvh #44; Ignis #3; tinybvh #249",
     "triangles without area are hit, or spoil the tree", degenerate_among_proper},
    {"only-degenerate", "svenstaro/bvh #44; tinybvh #249", "no triangle is left to build a tree from", only_degenerate},
    {"single-triangle", "svenstaro/bvh #44; Ignis #3", "the root is a leaf", single_triangle},
    {"no-triangle", "svenstaro/bvh #44; Ignis #3", "there is no root", no_triangle},
    // Intervals and origins.
    {"on-surfaces", "pbrt-v4, shapes_test.cpp (Reintersect)", "a ray starts on a triangle, on its edge or vertex",
     on_surfaces},
    {"interval-ends", "Ballot, design", "t_min and t_max are at, just before and just after a hit", interval_ends},
    {"offset-origins", "trimesh #48",
     "a ray that starts 1e-7 to 1 radii off a surface, and leaves it, hits that surface", offset_origins},
    {"collinear-report", "pbrt-v4, shapes_test.cpp (BadCases)", "a triangle of collinear vertices is hit",
     collinear_report},
    // Batches.
    {"ray-counts", "Embree #149; CWBVH #2", "the tail of a batch has fewer rays than a subgroup has lanes", ray_counts},
    {"dead-rays", "Embree #149; CWBVH #2", "dead rays are traced, or spoil the answers of their neighbours", dead_rays},
};

constexpr HardPointCase kPointCases[] = {
    {"coplanar-points", "trimesh #73; CloudCompare #1976",
     "points in the plane of a face, outside the face, get a distance of 0 or the wrong sign", coplanar_points},
    {"obtuse-triangles", "trimesh #310", "a corner is reported although the nearest point lies on an edge",
     obtuse_triangles},
    {"acute-edges", "trimesh #164; Baerentzen, Aanaes. TVCG 11(3), 2005",
     "of two equally near faces at a sharp edge, one has the point in front, the other behind", acute_edges},
    {"middles", "Ballot, design", "points equally far from many triangles: on medial axes, or an ulp off them",
     middles},
    {"shared-corner", "Ballot, design", "thousands of triangles have the nearest point in common", shared_corner},
    {"near-shells", "Ballot, design", "points between surfaces that are few ulp apart", near_shells},
    {"shell-lattice", "trimesh #242, #545", "points at and between faces, edges and corners that shells share",
     shell_lattice},
    {"far-shell-lattice", "Ballot, design", "the same as shell-lattice, of nested shells at 1e7", far_shell_lattice},
    {"points-at-collinear", "parry #76; scalismo #262", "a triangle without area is the nearest, or gives NaN",
     points_at_collinear},
    {"far-points", "Ballot, design", "squares of distances overflow; points with a NaN coordinate get an answer",
     far_points},
    {"limits-at-distances", "Ballot, design", "the limit of the search is the distance, or an ulp below or above it",
     limits_at_distances},
};

constexpr HardDoubleCase kDoubleCases[] = {
    {"utm-in-double", "Accelerad #4", "map coordinates, whose float32 spacing is half a metre", utm_in_double},
    {"earth-centred", "Ballot, design", "terrain in earth-centred coordinates, turned and 6 400 km from zero",
     earth_centred},
    {"satellites", "Ballot, design", "a city seen from 700 km above, in earth-centred coordinates", satellites},
    {"reactor", "Ballot, design", "walls of pipes and plates 1e-6 apart, in a box of 1e3", reactor},
    {"long-rays", "Mitsuba 3 #61", "rays of length 1e9 at a sphere of radius 100", long_rays},
    {"tiny-beside-large", "Embree, verify (small triangles)", "triangles of 1e-14 to 1e-8 beside one of 1e3",
     tiny_beside_large},
};

Scene with_vertex(const glm::vec3& bad) {
  Scene scene;
  scene.name = "refused";
  scene.triangles = octasphere(1);
  scene.triangles[3][1] = bad;
  return scene;
}

constexpr HardRefusal kRefusals[] = {
    {"nan-vertex", "svenstaro/bvh #44; Ignis #3", "a NaN vertex spoils every box above it", "nan",
     [] {
       return with_vertex({0, kNan, 0});
     }},
    {"infinite-vertex", "tinybvh #249", "an infinite vertex makes boxes without centre", "inf",
     [] {
       return with_vertex({kInf, 0, 0});
     }},
    {"negative-infinite-vertex", "tinybvh #249", "an infinite vertex makes boxes without centre", "-inf",
     [] {
       return with_vertex({0, 0, -kInf});
     }},
    {"beyond-1e12", "Embree #416", "products of lengths of 1e30 overflow float32", "1e+12",
     [] {
       return with_vertex({1e30f, 0, 0});
     }},
};

}  // namespace

std::span<const HardCase> hard_cases() { return kCases; }

std::span<const HardPointCase> hard_point_cases() { return kPointCases; }

std::span<const HardDoubleCase> hard_double_cases() { return kDoubleCases; }

std::span<const HardRefusal> hard_refusals() { return kRefusals; }

}  // namespace ballot
