// The frame of methods whose packets have BALLOT_RAYS rays in every lane. Such a method defines METHOD_PACKETS before
// lib/frame/main.glsl, and
//   walk_packet()                      walks packet[] (lib/packet/packet_rays.glsl)
//   traverse(w, live, node)            as other methods: one ray a lane, for packets whose rays are better traced one
//                                      by one
//
// Ray r of lane i is the packet's base + r * subgroup size + i, so that the rays of a packet are neighbours in the
// buffer.

uint packet_index(uint base, uint r) { return base + r * gl_SubgroupSize + gl_SubgroupInvocationID; }

bvec3 goes_down(Ray ray) { return lessThan(ray.dir, vec3(0.0)); }

// Returns the group of ray r. The rays of a group have directions in one octant (bit 0: down along x, 1: y, 2: z) and
// read a triangle's texels in one order (the last texel of that order is in the bits above).
uint group_of(uint r) {
  bvec3 down = goes_down(packet[r].ray);
  return (down.x ? 1u : 0u) | (down.y ? 2u : 0u) | (down.z ? 4u : 0u) | last_of(texel_order(packet[r].space)) << 3;
}

// Returns the groups that have rays in the packet, a bit each, and MEETS_ALL if some ray meets every box.
const uint MEETS_ALL = 1u << 24;
uint packet_groups() {
  uint groups = 0u;
  EACH_RAY(r) groups |= (alive >> r & 1u) != 0u ? 1u << group_of(r) : 0u;
#if BALLOT_FALLBACK && BALLOT_BOX == BOX_PADDED
  EACH_RAY(r) groups |= (alive >> r & 1u) != 0u && !has_slabs(packet[r].slabs) ? MEETS_ALL : 0u;
#endif
  return lanes_or(groups);
}

// Walks the groups one after the other.
void walk_groups(uint groups) {
  uint living = alive;
  do {
    uint group = uint(findLSB(groups));
    packet_order = order_to(group >> 3);
    packet_down = notEqual(uvec3(group) & uvec3(1u, 2u, 4u), uvec3(0u));
    alive = 0u;
    EACH_RAY(r) alive |= group_of(r) == group ? 1u << r : 0u;
    alive &= living;
    walk_packet();
    groups &= groups - 1u;
  } while (groups != 0u);
}

#if BALLOT_FALLBACK
const uint MOST_OCTANTS = 2u;  // a packet of more octants is traced ray by ray

// The octants of a set of groups, whatever the order of texels.
uint octants_of(uint groups) { return (groups | groups >> 8 | groups >> 16) & 255u; }

void trace_one_by_one(uint base) {
  uint r = 0u;
  do {
    trace_ray(packet_index(base, r));
    ++r;
  } while (r < BALLOT_RAYS);
  uint left = 0u;  // rays that the loop did not come to, because the driver cut it short
  EACH_RAY(i) {
    bool is_left = i >= r && packet_index(base, i) < RAY_END;
    if (is_left) store_hit(packet_index(base, i), Hit(0.0, UNFINISHED, 0.0, 0.0));
    left += uint(is_left);
  }
  finish_walks(left);
}
#endif

void trace_packet(uint base) {
  float scales[BALLOT_RAYS];
  alive = 0u;
  EACH_RAY(r) {
    Ray given;
    alive |= uint(take_ray(packet_index(base, r), packet[r], given)) << r;
    packet[r].slabs = mirrored(packet[r].slabs, goes_down(packet[r].ray));
    scales[r] = direction_scale(given.dir);
    COUNT_WIDE_BEGIN(r)
  }
  uint groups = packet_groups();
#if BALLOT_FALLBACK
  if (bitCount(octants_of(groups)) > MOST_OCTANTS || (groups & MEETS_ALL) != 0u) {
    trace_one_by_one(base);
    return;
  }
#endif
  walk_groups(groups);
  uint rays = 0u;
  EACH_RAY(r) rays += uint(packet_index(base, r) < RAY_END);
  bool finished = finish_walks(rays);
  EACH_RAY(r) {
    uint index = packet_index(base, r);
    COUNT_WIDE_END(r)
    if (index < RAY_END) write_hit(index, packet[r], scales[r], finished);
  }
}
