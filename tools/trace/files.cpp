#include "tools/trace/files.h"

#include <algorithm>
#include <utility>

namespace ballot::cli {

namespace {

constexpr std::size_t kBlockRays = 1 << 20;  // 32 MiB

}  // namespace

ReadAhead::ReadAhead(RayFile file) : file_(std::move(file)), left_(file_.count()) { begin(); }

void ReadAhead::begin() {
  next_.resize(std::size_t(std::min<std::uint64_t>(kBlockRays, left_)));
  left_ -= next_.size();
  reading_ = std::async(std::launch::async, [this] { next_.resize(file_.read(next_)); });
}

std::size_t ReadAhead::next(std::span<Ray> room) {
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
    copy_parallel(std::span<const Ray>(block_).subspan(used_, some), room.subspan(done, some));
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

/// Traces all rays of a file; `write` gets the bytes of the result.
FileTrace trace_to(DeviceScene& world, RayFile file, const WriteBehind::Write& write, const Query& query,
                   const Progress& progress) {
  FileTrace result;
  result.rays = file.count();
  const std::string start = hits_start(result.rays);
  const std::shared_ptr<MovedRays> moved = file.ask(world.recentring());
  std::vector<Hit> told;
  ReadAhead in(std::move(file));
  WriteBehind out(write);
  out.add(std::as_bytes(std::span(start)));
  RayStream stream{
      .most = result.rays,
      .next =
          [&](std::uint64_t, std::span<Ray> room) {
            const std::size_t count = in.next(room);
            if (result.ray_class.empty() && query.method == kAuto && count)
              result.ray_class = ray_class(room.first(count));
            return count;
          },
      .take =
          [&](std::uint64_t, std::span<const Hit> hits) {
            result.hits += count_hits(hits);
            told.assign(hits.begin(), hits.end());
            moved->tell_as_given(told);
            out.add(std::as_bytes(std::span(told)));
          },
      .progress = [&](std::uint64_t done) { progress(double(done) / double(result.rays)); },
  };
  world.tracer().variant(query);  // an unknown method is an error even without rays
  result.times = world.tracer().trace(stream, query);
  out.finish();
  result.dead = in.dead();
  return result;
}

}  // namespace

FileTrace trace_file(DeviceScene& world, RayFile file, const std::string& to, const Query& query,
                     const Progress& progress) {
  if (const std::optional<int> stream = descriptor_of(to))
    return trace_to(
        world, std::move(file), [&](std::span<const std::byte> bytes) { write_stream(*stream, bytes); }, query,
        progress);
  FileTrace result;
  write_atomically(to, [&](OutputFile& out) {
    const auto write = [&](std::span<const std::byte> bytes) { out.write(bytes.data(), bytes.size()); };
    result = trace_to(world, std::move(file), write, query, progress);
  });
  return result;
}

}  // namespace ballot::cli
