// Sides of a projected edge for a point at the origin, with ties broken by symbolic perturbation. The proofs are in
// shaders/query/inside.comp.

// Returns the side of the edge from p to q: zero if the line of the edge goes through the origin. The sign is exact.
float side_value(vec2 p, vec2 q) { return difference_of_products(q.x, p.y, q.y, p.x); }

// Returns 1 or -1: the sign of the side, if that is zero after an infinitesimal step of the origin along the first
// axis, and after a yet smaller one along the second. Returns 0 if p and q are the same.
int side_sign(float side, vec2 p, vec2 q) {
  if (side != 0.0) return side > 0.0 ? 1 : -1;
  if (p.y != q.y) return q.y > p.y ? 1 : -1;
  return p.x > q.x ? 1 : p.x < q.x ? -1 : 0;
}
