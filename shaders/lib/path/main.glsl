// The last part of an integrator's kernel: main(), which takes a hit for each invocation, has the integrator shade it,
// and appends the rays that it started to the queues. A wave holds at most one ray of each path, so a path's light is
// summed in a fixed order. New rays are written without gaps: the next wave has as many rays as are still needed.

// Reserves places in a queue for the rays of a subgroup, with one atomic operation. `first` is the place of the first
// ray.
#define APPEND(counter, wanted, first)                                            \
  {                                                                               \
    uvec4 who = subgroupBallot(wanted);                                           \
    if (subgroupElect()) first = atomicAdd(counter, subgroupBallotBitCount(who)); \
    first = subgroupBroadcastFirst(first);                                        \
  }

// Returns the state of a path that begins at the camera.
Carried carried_at_eye(uint path) { return Carried(vec3(1.0), path, 0.0, push.cone_width, push.cone_spread, 0u); }

// Reads the ray of this invocation, or computes it if it is a camera ray that need not be stored.
Ray ray_at_hand(uint index, PixelSample sampled) {
#if BALLOT_MAKES_RAYS
  if (push.made != 0u) return camera_ray_of(cameras[push.camera], sampled);
#endif
  return get_ray(rays, index);
}

// Returns the sample that a path belongs to. The division is done in float, because CPU devices divide integers lane by
// lane. A wave has at most 2^24 paths, which floats hold exactly, so only the quotient is rounded. It is
// below 2^22 (Tracer::chunk_rays()), so Vulkan's 2.5 ulp are less than 1.
PixelSample sample_of_path(uint path) {
  uint together = push.samples.together, i = uint(float(path) / float(together));
  if (i * together > path) --i;
  if (path - i * together >= together) ++i;
  return pixel_sample(push.samples, i, path - i * together);
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  Started started;
  started.shadow = started.next = started.second = false;
  if (index < indirect[push.args].count) {
    bool begins = push.depth == 0u;  // ray i belongs to path i then
    Carried c = carried_at_eye(index);
    Path path = Path(vec3(0.0), 0u);
#if STARTS_NEXT
    if (!begins) {
      c = get_carried(carried, index);
      path = get_path(paths, c.path);
    }
#endif
    PixelSample sampled = sample_of_path(c.path);
    Ray ray = ray_at_hand(index, sampled);
    Hit hit = get_hit(hits, index);
    vec3 before = path.radiance;
#if STARTS_SECOND
    begin_ray(c.path);
#endif
    if (hit.prim != NO_HIT) {
      shade_hit(path, sampled, ray, hit, c, started);
    } else {
      if (RAY_DEPTH == 0u && sampled.sample_index == 0u) record_first(sampled, ray, hit, vec3(0.0));
#if BALLOT_SKY != SKY_NONE
      path.radiance += c.throughput * sky_seen(normalize(ray.dir), c.pdf);
#endif
    }
    if (begins || path.radiance != before) put_part(paths, c.path, path);
    started.next_carried.path = started.second_carried.path = c.path;
#if STARTS_SECOND
    choose_next(c.path, started);
#endif
  }
  uint first = 0u;
#if STARTS_SHADOW
  APPEND(queues.shadow, started.shadow, first)
  PUT_RECORDS(shadow_rays, first, started.shadow, started.shadow_ray)
  uint place = first + subgroupBallotExclusiveBitCount(subgroupBallot(started.shadow));
  if (started.shadow) put_part(shadow_payload, place, ShadowPayload(started.light, started.next_carried.path));
#endif
#if STARTS_NEXT
  APPEND(queues.next, started.next, first)
  PUT_RECORDS(next_rays, first, started.next, started.next_ray)
  PUT_RECORDS(next_carried, first, started.next, started.next_carried)
#endif
}
