// What the instrumented variant of a kernel counts over a batch.
#include <algorithm>

#include "engine/core/error.h"
#include "engine/render/batch.h"

namespace ballot {

namespace {

struct Counted {
  const char* name;
  std::uint32_t RayStats::*field;
};
constexpr Counted kCounted[] = {
    {"nodes", &RayStats::nodes},
    {"nodes_needed", &RayStats::nodes_needed},
    {"leaves", &RayStats::leaves},
    {"leaves_needed", &RayStats::leaves_needed},
    {"triangles", &RayStats::triangles},
    {"triangles_tested", &RayStats::triangles_tested},
    {"packet_nodes", &RayStats::packet_nodes},
    {"lanes", &RayStats::lanes},
    {"steps", &RayStats::steps},
    {"unneeded", &RayStats::unneeded},
    {"few", &RayStats::few},
    {"votes", &RayStats::votes},
    {"disagreements", &RayStats::disagreements},
    {"switches", &RayStats::switches},
    {"switch_depth", &RayStats::switch_depth},
    {"overflows", &RayStats::overflows},
    {"fetches", &RayStats::fetches},
};

double share(double part, double whole) { return whole > 0 ? part / whole : 0; }

}  // namespace

Counters Batches::count(RayBatch& batch, Query query) {
  query.want = batch.want_;
  const Variant variant = tracer_.variant(query, true);
  Counters sums;
  double stack_max = 0;
  for (Chunk& c : batch.chunks_) {
    Buffer<RayStats> buffer(gpu_, c.count, Access::Storage, batch.name_ + " counters");
    tracer_.trace_counted(c.rays, c.hits, c.count, query, buffer);
    std::vector<RayStats> all(c.count);
    buffer.download(all);
    for (const RayStats& ray : all) {
      for (const Counted& counted : kCounted) sums[counted.name] += ray.*counted.field;
      stack_max = std::max(stack_max, double(ray.stack));
    }
  }
  const double active = share(sums["nodes_needed"] + sums["leaves_needed"], sums["steps"] * variant.how.subgroup);
  const double packet = share(sums["packet_nodes"], sums["nodes"]);
  for (auto& [name, sum] : sums) sum = share(sum, double(batch.count_));
  sums["active_share"] = active;
  sums["packet_share"] = packet;
  sums["stack_max"] = stack_max;
  return sums;
}

}  // namespace ballot
