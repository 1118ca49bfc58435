// Deferred rays of paths that split at glass. Of the two rays, the mirrored one continues. The refracted one waits
// until the mirrored one and all rays that come of it have ended. So a path works on one ray at a time, in an order of
// its own, whatever the other paths of its wave of rays (lib/path/kernel.glsl) do.

Deferred at;  // the state of this invocation's path
#define RAY_DEPTH at.depth

uint deferred_slot(uint path, uint depth) { return depth * push.paths + path; }

// Loads the state of a path.
void begin_ray(uint path) {
  at = Deferred(0u, 0u, 0u);
  if (push.depth > 0u) at = deferred[path];
}

// Chooses the ray that the path continues with: the mirrored ray that the current one started, else the refracted one,
// else the deepest deferred ray. If the current ray started both, defers the refracted one.
void choose_next(uint path, inout Started started) {
  uint bit = 1u << (at.depth & 31u);
  if (started.next && started.second) {
    put_record(deferred_rays, deferred_slot(path, at.depth), started.second_ray);
    put_record(deferred_carried, deferred_slot(path, at.depth), started.second_carried);
    if (at.depth < 32u) at.low |= bit; else at.high |= bit;
  } else if (started.second) {
    started.next = true;
    started.next_ray = started.second_ray;
    started.next_carried = started.second_carried;
  }
  if (!started.next && (at.low | at.high) != 0u) {  // the deepest one, as a recursion would do
    at.depth = at.high != 0u ? 32u + uint(findMSB(at.high)) : uint(findMSB(at.low));
    bit = 1u << (at.depth & 31u);
    if (at.depth < 32u) at.low &= ~bit; else at.high &= ~bit;
    started.next = true;
    started.next_ray = get_ray(deferred_rays, deferred_slot(path, at.depth));
    started.next_carried = get_carried(deferred_carried, deferred_slot(path, at.depth));
  }
  ++at.depth;
  deferred[path] = at;
}
