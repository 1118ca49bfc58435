// Runs Embree's ray queries over batches, for comparison: as single rays and as packets, on any number of threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "engine/scene/device_scene.h"
#include "tests/check/embree_scene.h"

namespace ballot::speed {

/// A way to call Embree: the number of rays per call, and the flag that tells Embree that they are coherent.
struct EmbreeCall {
  unsigned width;  // 1, 8 or 16
  bool coherent;
  std::string name() const { return "Embree " + std::to_string(width) + (coherent ? " coherent" : ""); }
};
inline constexpr EmbreeCall kEmbreeCalls[] = {{1, false}, {1, true}, {8, false}, {8, true}, {16, false}, {16, true}};

/// A scene of Embree that traces by any of its calls.
class EmbreeTracer : public EmbreeScene {
 public:
  using EmbreeScene::EmbreeScene;

  /// Traces rays and writes one hit per ray. With `any`, t of a hit is -infinity; prim, u, v mean nothing. Packets are
  /// runs of neighbouring rays. The time to fill them is part of the call.
  void trace(EmbreeCall call, bool any, std::span<const Ray> rays, std::span<Hit> hits, unsigned threads) const {
    constexpr std::size_t kPart = 4096;
    std::atomic<std::size_t> next = 0;
    const auto work = [&] {
      for (std::size_t b; (b = next.fetch_add(kPart)) < rays.size();) {
        const std::size_t n = std::min(kPart, rays.size() - b);
        trace_part(call, any, rays.subspan(b, n), hits.subspan(b, n));
      }
    };
    std::vector<std::thread> others;
    for (unsigned t = 1; t < threads; ++t) others.emplace_back(work);
    work();
    for (std::thread& t : others) t.join();
  }

 private:
  void trace_part(EmbreeCall call, bool any, std::span<const Ray> rays, std::span<Hit> hits) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = call.coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    if (call.width == 1)
      for (std::size_t i = 0; i < rays.size(); ++i) trace_one(context, any, rays[i], hits[i]);
    else if (call.width == 8)
      trace_packets<RTCRayHit8>(context, any, rays, hits, rtcIntersect8, rtcOccluded8);
    else
      trace_packets<RTCRayHit16>(context, any, rays, hits, rtcIntersect16, rtcOccluded16);
  }

  void trace_one(RTCIntersectContext& context, bool any, const Ray& r, Hit& hit) const {
    RTCRayHit q{};
    q.ray = {r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, 0, r.t_max, ~0u, 0, 0};
    q.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    if (any)
      rtcOccluded1(scene_, &context, &q.ray);
    else
      rtcIntersect1(scene_, &context, &q);
    const bool found = any ? q.ray.tfar < 0 : q.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    hit = {q.ray.tfar, found ? q.hit.primID : NO_HIT, q.hit.u, q.hit.v};
  }

  template <class Packet, class Intersect, class Occluded>
  void trace_packets(RTCIntersectContext& context, bool any, std::span<const Ray> rays, std::span<Hit> hits,
                     Intersect intersect, Occluded occluded) const {
    constexpr std::size_t kWidth = sizeof(Packet::ray.tfar) / sizeof(float);
    for (std::size_t b = 0; b < rays.size(); b += kWidth) {
      const std::size_t n = std::min(kWidth, rays.size() - b);
      alignas(64) int valid[kWidth];
      alignas(64) Packet q;
      for (std::size_t i = 0; i < kWidth; ++i) {
        const Ray& r = rays[b + std::min(i, n - 1)];
        valid[i] = i < n ? -1 : 0;
        q.ray.org_x[i] = r.origin.x, q.ray.org_y[i] = r.origin.y, q.ray.org_z[i] = r.origin.z;
        q.ray.dir_x[i] = r.dir.x, q.ray.dir_y[i] = r.dir.y, q.ray.dir_z[i] = r.dir.z;
        q.ray.tnear[i] = r.t_min, q.ray.tfar[i] = r.t_max, q.ray.time[i] = 0;
        q.ray.mask[i] = ~0u, q.ray.id[i] = 0, q.ray.flags[i] = 0;
        q.hit.geomID[i] = q.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
      }
      if (any)
        occluded(valid, scene_, &context, &q.ray);
      else
        intersect(valid, scene_, &context, &q);
      for (std::size_t i = 0; i < n; ++i) {
        const bool found = any ? q.ray.tfar[i] < 0 : q.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
        hits[b + i] = {q.ray.tfar[i], found ? q.hit.primID[i] : NO_HIT, q.hit.u[i], q.hit.v[i]};
      }
    }
  }
};

}  // namespace ballot::speed
