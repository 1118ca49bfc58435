// A cluster of a tree that is refitted. The file that includes this one declares push, a RefitPush, and includes
// triangles.glsl, clusters.glsl and area.glsl.
bool changed = false;  // a triangle of the tree has lost its area

// Returns a cluster with its new box and cost, once its node has them.
Item refitted(uint cluster) {
  Item item;
  if (is_triangle(cluster)) {
    item = item_of_triangle(index_of(cluster), 0.0);
    changed = changed || has_no_area(corners_of(prims[index_of(cluster)]));
  } else {
    item = item_of_node(cluster);
  }
  // A node has the cost that it has as an inner node. Whether it is a leaf stands where it is referred to.
  if (is_leaf(cluster))
    item.cost = half_area(item.lo, item.hi) * push.intersection_cost * float(count_of(cluster));
  return item;
}
