// Traces streams of rays from host memory: copying in, tracing and copying out overlap where the device allows it.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/answer/dispatch.h"
#include "engine/answer/query.h"

namespace ballot {

class Tracer;

/// The two ends of a stream of rays. Both are called from the thread that traces, in the order of the rays.
struct RayStream {
  std::uint64_t most = ~0ull;  // no more rays than this will come; smaller streams get smaller buffers
  /// Writes the next rays to the front of `room` and returns how many. Fewer than room.size() end the stream.
  std::function<std::size_t(std::span<Ray> room)> next;
  /// Takes the hits of the next rays. The span is valid until the function returns. If the device wrote the hits in
  /// place, it is the span that in_place() gave; if the driver refused that memory, it is another.
  std::function<void(std::span<const Hit> hits)> take;
  /// Where rays lie in the host's memory, and where their hits belong. If `rays` is null, the rays come through next().
  /// If `hits` is null, the hits have no place of their own. take() is called either way.
  struct Places {
    const Ray* rays = nullptr;
    Hit* hits = nullptr;
  };
  /// Returns the places of the next `count` rays. It is called only for a device that is the CPU, which uses the
  /// caller's arrays in place. Rays with a place do not come through next(). The function may be empty.
  std::function<Places(std::size_t count)> in_place = {};
  /// Is called after each chunk with the number of rays that are done. May throw to end the trace. May be empty.
  std::function<void(std::uint64_t done)> progress = {};
};

/// Returns how many of the records are hits: their prim is not NO_HIT.
std::uint64_t count_hits(std::span<const Hit> hits);

/// The buffers that streams go through. They are kept for the next stream. A GPU has three sets: while it traces one
/// chunk, the host fills the next and empties the one before. They take at most 144 MiB on the device. A GPU with
/// memory of its own needs as much again on the host, to copy from and to. A device that is the CPU has one set, and it
/// uses the caller's arrays in place where RayStream::in_place names them.
///
/// Belongs to the thread of its Context.
class StreamRing {
 public:
  explicit StreamRing(Context& gpu) : gpu_(gpu) {}

  /// Traces a stream. Rays of a query whose method is auto are classified chunk by chunk, unless query.rays names their
  /// class. Throws what the stream's functions throw; the ring can be used again after that.
  TraceTimes run(Tracer& tracer, const RayStream& stream, const Query& query);

 private:
  /// The buffers of one chunk.
  struct Slot {
    Buffer<Ray> rays;
    Buffer<Hit> hits;
    std::optional<Buffer<Ray>> rays_there = {};  // the host's side, on a device with memory of its own
    std::optional<Buffer<Hit>> hits_there = {};
    std::uint32_t count = 0;                        // rays in it; 0: free
    std::uint64_t submission = 0;                   // that traces them
    std::optional<Buffer<Ray>> rays_in_place = {};  // the caller's arrays, while the device uses them
    std::optional<Buffer<Hit>> hits_in_place = {};

    Buffer<Ray>& from() { return rays_in_place ? *rays_in_place : rays; }
    Buffer<Hit>& to() { return hits_in_place ? *hits_in_place : hits; }
    void release() { rays_in_place.reset(), hits_in_place.reset(); }
  };
  /// Lets go of the callers' arrays when a stream has ended, also by an exception.
  struct InPlaceScope {
    std::vector<Slot>& slots;
    ~InPlaceScope() { std::ranges::for_each(slots, &Slot::release); }
  };

  void make_room(std::size_t chunk);
  std::span<Ray> room(Slot& slot) const;
  std::size_t fill(Slot& slot, const RayStream& stream, std::size_t& asked);
  void trace(Tracer& tracer, Slot& slot, Query query, std::uint64_t batch, TraceTimes& times);
  void copy(Slot& slot, bool in);
  void deliver(Slot& slot, const RayStream& stream, std::uint64_t& done);

  Context& gpu_;
  std::vector<Slot> slots_;
  std::size_t chunk_ = 0;  // rays of a slot
  bool imports_ = true;    // no import of a caller's rays has failed yet
};

}  // namespace ballot
