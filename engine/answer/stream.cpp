#include "engine/answer/stream.h"

#include <algorithm>
#include <atomic>
#include <bit>
#include <utility>

#include "engine/answer/tracer.h"
#include "engine/core/error.h"
#include "engine/core/parallel.h"

namespace ballot {

namespace {

constexpr std::size_t kSlots = 3;
constexpr std::size_t kChunk = 1u << 20;     // rays: 32 MiB in, 16 MiB out
constexpr std::size_t kCpuChunk = 1u << 18;  // of devices that are the CPU: stays in its cache
// Rays that are traced in place at once. Their arrays have a size that llvmpipe compiles no kernel anew for
// (steady_size() in gpu/buffer.cpp).
constexpr std::size_t kInPlace = kCpuChunk - 8;
constexpr std::size_t kLeastChunk = 1u << 12;  // so that small batches of other sizes need no new buffers

/// Returns a buffer over memory of the host; none if the driver refuses it.
template <class T>
std::optional<Buffer<T>> import(Context& gpu, T* data, const char* name) {
  if (!data || !RawBuffer::can_import(gpu, data)) return {};
  try {
    return Buffer<T>(gpu, std::span(data, kInPlace), name);
  } catch (const Error&) {
    return {};
  }
}

}  // namespace

std::uint64_t count_hits(std::span<const Hit> hits) {
  std::atomic<std::uint64_t> count{0};
  for_chunks(hits.size(), 1 << 16, [&](std::size_t begin, std::size_t end) {
    std::uint64_t some = 0;
    for (const Hit& h : hits.subspan(begin, end - begin)) some += h.prim != NO_HIT;
    count += some;
  });
  return count;
}

void StreamRing::make_room(std::size_t chunk) {
  if (chunk <= chunk_) return;
  slots_.clear();
  chunk_ = 0;
  const auto make = [&] {
    Slot slot{{gpu_, chunk, Access::Storage, "rays"}, {gpu_, chunk, Access::Storage, "hits"}};
    if (slot.rays.mapped() && slot.hits.mapped()) return slot;  // the host sees them
    slot.rays_there.emplace(gpu_, chunk, Access::Host, "rays of the host");
    slot.hits_there.emplace(gpu_, chunk, Access::Host, "hits of the host");
    return slot;
  };
  while (slots_.size() < (gpu_.info().is_cpu() ? 1 : kSlots)) slots_.push_back(make());
  chunk_ = chunk;
}

std::span<Ray> StreamRing::room(Slot& slot) const {
  std::byte* bytes = slot.rays_there ? slot.rays_there->mapped() : slot.rays.mapped();
  return {reinterpret_cast<Ray*>(bytes), chunk_};
}

void StreamRing::copy(Slot& slot, bool in) {
  if (!slot.rays_there) return;
  gpu_.pass(in ? "copying rays in" : "copying hits out", [&](Commands& cmd) {
    if (in)
      cmd.copy(*slot.rays_there, slot.rays, slot.count * sizeof(Ray));
    else
      cmd.copy(slot.hits, *slot.hits_there, slot.count * sizeof(Hit));
  });
}

void StreamRing::trace(Tracer& tracer, Slot& slot, Query query, std::uint64_t batch, TraceTimes& times) {
  const std::span<const Ray> rays =
      slot.rays_in_place ? std::span(reinterpret_cast<const Ray*>(std::as_const(*slot.rays_in_place).mapped()), chunk_)
                         : room(slot);
  tracer.classify(query, rays.first(slot.count), batch);
  if (tracer.prefill) {
    const std::vector<std::uint8_t> pattern(slot.count * sizeof(Hit), *tracer.prefill);
    slot.to().RawBuffer::upload(0, pattern.data(), pattern.size());
  }
  copy(slot, true);
  query = tracer.resolve(std::move(query), slot.from(), slot.count, batch);
  if (tracer.can_record(query, slot.count)) {
    ++times.dispatches;
    tracer.record(slot.from(), slot.to(), slot.count, query, [&times](double ms) { times.device_ms += ms; });
  } else {
    const TraceTimes part = tracer.trace(slot.from(), slot.to(), slot.count, query);
    times.device_ms += part.device_ms;
    times.dispatches += part.dispatches;
    times.retraced += part.retraced;
  }
  copy(slot, false);
  slot.submission = gpu_.flush();
}

void StreamRing::deliver(Slot& slot, const RayStream& stream, std::uint64_t& done) {
  if (slot.count == 0) return;
  gpu_.wait(slot.submission);
  const std::byte* bytes = slot.hits_there ? slot.hits_there->mapped() : slot.to().mapped();
  const std::size_t count = std::exchange(slot.count, 0);
  stream.take({reinterpret_cast<const Hit*>(bytes), count});
  done += count;
  if (stream.progress) stream.progress(done);
}

// Fills a slot with up to `asked` rays and returns their number. Asks for fewer, and says so in `asked`, if the device
// uses the caller's arrays in place.
std::size_t StreamRing::fill(Slot& slot, const RayStream& stream, std::size_t& asked) {
  slot.release();
  if (stream.in_place && imports_ && slots_.size() == 1 && asked >= kInPlace) {
    const RayStream::Places places = stream.in_place(kInPlace);
    if (places.rays || places.hits) asked = kInPlace;
    slot.hits_in_place = import(gpu_, places.hits, "hits in place");
    if (places.rays) {
      slot.rays_in_place = import(gpu_, const_cast<Ray*>(places.rays), "rays in place");  // the device only reads them
      imports_ = slot.rays_in_place.has_value();
      if (!imports_) copy_parallel(std::span(places.rays, kInPlace), room(slot).first(kInPlace));
      return kInPlace;
    }
  }
  return stream.next(room(slot).first(asked));
}

TraceTimes StreamRing::run(Tracer& tracer, const RayStream& stream, const Query& query) {
  const std::size_t most = gpu_.info().is_cpu() ? kCpuChunk : kChunk;
  make_room(std::clamp<std::size_t>(std::bit_ceil(std::min<std::uint64_t>(stream.most, most)), kLeastChunk,
                                    std::min<std::size_t>(most, tracer.chunk_rays())));
  for (Slot& slot : slots_) slot.count = 0;  // of a stream that threw
  const InPlaceScope places{slots_};
  const PassScope scope(gpu_);
  TraceTimes times;
  std::uint64_t done = 0, begun = 0;
  std::size_t turn = 0;
  for (bool more = stream.most > 0; more; ++turn) {
    Slot& slot = slots_[turn % slots_.size()];
    deliver(slot, stream, done);
    auto asked = std::size_t(std::min<std::uint64_t>(chunk_, stream.most - begun));
    const std::size_t count = fill(slot, stream, asked);
    begun += count;
    more = count == asked && begun < stream.most;
    if (count == 0) break;
    slot.count = std::uint32_t(count);
    trace(tracer, slot, query, stream.most, times);
  }
  for (std::size_t i = 0; i < slots_.size(); ++i) deliver(slots_[(turn + i) % slots_.size()], stream, done);
  return times;
}

}  // namespace ballot
