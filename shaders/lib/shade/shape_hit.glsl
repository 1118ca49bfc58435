// Hits on shapes other than triangles, as shading reads them. Included by triangles.glsl if BALLOT_HAS_SHAPES.

// Has a hit on a shape look like its first vertex: u and v tell the normal, so they are no weights of vertices.
#define WEIGHTS_OF_VERTICES(hit) \
  if (placed.shapes) hit.u = hit.v = 0.0;

// Returns the outward normal in the world, of any length, that u and v of a shape's hit tell. Each operation is rounded
// by itself, and the same on every device. The matrix of cofactors moves it, as in moved_normal().
vec3 normal_of_shape(Hit hit) {
  precise vec2 p = 2.0 * vec2(hit.u, hit.v) - 1.0;
  precise float z = 1.0 - abs(p.x) - abs(p.y);
  precise vec2 fold = 1.0 - abs(p.yx);
  if (z < 0.0) p = vec2(p.x < 0.0 ? -fold.x : fold.x, p.y < 0.0 ? -fold.y : fold.y);
  vec3 n = vec3(p, z), x = placed.x.xyz, y = placed.y.xyz, w = placed.z.xyz;
  vec3 most = max(max(abs(x), abs(y)), abs(w));
  uint exponent = floatBitsToUint(max(max(most.x, most.y), most.z)) >> 23;
  float scale = uintBitsToFloat((254u - clamp(exponent, 1u, 253u)) << 23);
  precise vec3 a = x * scale, b = y * scale, c = w * scale;
  precise vec3 bc = vec3(b.y * c.z - b.z * c.y, b.z * c.x - b.x * c.z, b.x * c.y - b.y * c.x);
  precise vec3 ca = vec3(c.y * a.z - c.z * a.y, c.z * a.x - c.x * a.z, c.x * a.y - c.y * a.x);
  precise vec3 ab = vec3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  precise float volume = a.x * bc.x + a.y * bc.y + a.z * bc.z;
  precise vec3 to = vec3(bc.x * n.x + bc.y * n.y + bc.z * n.z, ca.x * n.x + ca.y * n.y + ca.z * n.z,
                         ab.x * n.x + ab.y * n.y + ab.z * n.z);
  return volume < 0.0 ? -to : to;
}
