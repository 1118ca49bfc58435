#include "tools/trace/files.h"

#include <algorithm>
#include <utility>

namespace ballot::cli {

namespace {

constexpr std::size_t kBlockRays = 1 << 20;  // 32 MiB

}  // namespace

template <class Kind>
ReadAhead<Kind>::ReadAhead(RayFile file) : file_(std::move(file)), left_(file_.count()) {
  begin();
}

template <class Kind>
void ReadAhead<Kind>::begin() {
  next_.resize(std::size_t(std::min<std::uint64_t>(kBlockRays, left_)));
  left_ -= next_.size();
  reading_ = std::async(std::launch::async, [this] { next_.resize(file_.read(next_)); });
}

template <class Kind>
std::size_t ReadAhead<Kind>::next(std::span<Kind> room) {
  std::size_t done = 0;
  while (done < room.size()) {
    if (used_ == block_.size()) {
      if (!reading_.valid()) break;
      reading_.get();
      block_.swap(next_);
      used_ = 0;
      if (left_ > 0) begin();
    }
    const std::size_t some = std::min(room.size() - done, block_.size() - used_);
    copy_parallel(std::span<const Kind>(block_).subspan(used_, some), room.subspan(done, some));
    used_ += some;
    done += some;
  }
  return done;
}

void WriteBehind::add(std::span<const std::byte> bytes) {
  next_.resize(bytes.size());
  copy_parallel(bytes, std::span<std::byte>(next_));
  finish();
  block_.swap(next_);
  writing_ = std::async(std::launch::async, [this] { write_(block_); });
}

void WriteBehind::finish() {
  if (writing_.valid()) writing_.get();
}

namespace {

std::string class_of(std::span<const Ray> rays) { return ray_class(rays); }
std::string class_of(std::span<const RayInDouble> rays) {
  std::vector<Ray> single(rays.size());
  std::ranges::transform(rays, single.begin(), [](const RayInDouble& ray) { return rounded(ray); });
  return ray_class(std::span<const Ray>(single));
}

/// Tells hits of a world's rays as the file of rays has these.
class TellHits {
 public:
  TellHits(const DeviceScene& world, std::shared_ptr<MovedRays> moved, bool t_double)
      : world_(world), moved_(std::move(moved)), t_double_(t_double) {
    if (t_double) moved_->keep_rays();
  }
  std::string start(std::uint64_t rays) const { return t_double_ ? hits_in_double_start(rays) : hits_start(rays); }
  /// Returns the bytes of hits in a file, valid until the next call.
  std::span<const std::byte> tell(std::span<const Hit> hits) {
    if (!t_double_) {
      told_.assign(hits.begin(), hits.end());
      moved_->tell_as_given(told_);
      return std::as_bytes(std::span(told_));
    }
    const std::vector<double> t = moved_->t_in_double(hits, [&](const Hit& hit) {
      return world_.shape_normal(hit) ? std::nullopt : std::optional(world_.triangle(hit.prim));
    });
    wide_.clear();
    for (std::size_t i = 0; i < hits.size(); ++i)
      wide_.push_back({std::bit_cast<std::array<std::uint32_t, 2>>(t[i]), hits[i].prim, hits[i].u, hits[i].v});
    return std::as_bytes(std::span(wide_));
  }

 private:
  const DeviceScene& world_;
  std::shared_ptr<MovedRays> moved_;
  bool t_double_;
  std::vector<Hit> told_;
  std::vector<HitInDouble> wide_;
};

/// Traces all rays of a file, as `Kind`; `write` gets the bytes of the result.
template <class Kind>
FileTrace trace_as(DeviceScene& world, RayFile file, const WriteBehind::Write& write, const Query& query, bool t_double,
                   const Progress& progress) {
  FileTrace result;
  result.rays = file.count();
  TellHits told(world, file.ask(world.recentring()), t_double);
  const std::string start = told.start(result.rays);
  ReadAhead<Kind> in(std::move(file));
  WriteBehind out(write);
  out.add(std::as_bytes(std::span(start)));
  Stream<Kind, Hit> stream{
      .most = result.rays,
      .next =
          [&](std::uint64_t, std::span<Kind> room) {
            const std::size_t count = in.next(room);
            if (result.ray_class.empty() && query.method == kAuto && count)
              result.ray_class = class_of(room.first(count));
            return count;
          },
      .take =
          [&](std::uint64_t, std::span<const Hit> hits) {
            result.hits += count_hits(hits);
            out.add(told.tell(hits));
          },
      .progress = [&](std::uint64_t done) { progress(double(done) / double(result.rays)); },
  };
  world.tracer().variant(query);  // an unknown method is an error even without rays
  result.times = world.tracer().trace(stream, query);
  out.finish();
  result.dead = in.dead();
  return result;
}

/// Traces them in double if the mode is, and float32 does not hold them.
FileTrace trace_to(DeviceScene& world, RayFile file, const WriteBehind::Write& write, const Query& query, bool t_double,
                   const Progress& progress) {
  const bool wide = find_numeric(query.numeric).triangle == TRIANGLE_DOUBLE && file.is_wide(world.recentring());
  const auto trace = wide ? trace_as<RayInDouble> : trace_as<Ray>;
  return trace(world, std::move(file), write, query, t_double, progress);
}

}  // namespace

FileTrace trace_file(DeviceScene& world, RayFile file, const std::string& to, const Query& query, bool t_double,
                     const Progress& progress) {
  if (const std::optional<int> stream = descriptor_of(to))
    return trace_to(
        world, std::move(file), [&](std::span<const std::byte> bytes) { write_stream(*stream, bytes); }, query,
        t_double, progress);
  FileTrace result;
  write_atomically(to, [&](OutputFile& out) {
    const auto write = [&](std::span<const std::byte> bytes) { out.write(bytes.data(), bytes.size()); };
    result = trace_to(world, std::move(file), write, query, t_double, progress);
  });
  return result;
}

}  // namespace ballot::cli
