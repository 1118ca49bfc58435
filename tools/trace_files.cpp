#include "tools/trace_files.h"

#include <algorithm>
#include <utility>

namespace ballot::cli {

namespace {

constexpr std::size_t kBlockRays = 1 << 20;  // 32 MiB
constexpr std::size_t kBlocks = 3;           // read or to be written, at a time

}  // namespace

ReadAhead::ReadAhead(RayFile file) : file_(std::move(file)), full_(kBlocks), free_(kBlocks + 1) {
  const std::size_t rays = std::size_t(std::min<std::uint64_t>(kBlockRays, file_.count()));
  for (std::size_t i = 0; i < kBlocks; ++i) free_.put(std::vector<Ray>(rays));
  thread_ = std::jthread([this] { run(); });
}

ReadAhead::~ReadAhead() {
  full_.close();
  free_.close();
}

void ReadAhead::run() {
  try {
    for (std::uint64_t left = file_.count(); left > 0;) {
      std::optional<std::vector<Ray>> block = free_.take();
      if (!block) return;
      block->resize(std::size_t(std::min<std::uint64_t>(block->size(), left)));
      left -= file_.read(*block);
      if (!full_.put(std::move(*block))) return;
    }
  } catch (...) {
    failure_ = std::current_exception();
  }
  full_.close();
}

std::size_t ReadAhead::next(std::span<Ray> room) {
  std::size_t done = 0;
  while (done < room.size()) {
    if (used_ == block_.size()) {
      if (!block_.empty()) free_.put(std::exchange(block_, {}));
      std::optional<std::vector<Ray>> block = full_.take();
      if (!block) break;
      block_ = std::move(*block);
      used_ = 0;
    }
    const std::size_t some = std::min(room.size() - done, block_.size() - used_);
    copy_parallel(std::span<const Ray>(block_).subspan(used_, some), room.subspan(done, some));
    used_ += some;
    done += some;
  }
  if (done < room.size() && failure_) std::rethrow_exception(failure_);
  return done;
}

WriteBehind::WriteBehind(Write write) : write_(std::move(write)), full_(kBlocks), free_(kBlocks + 1) {
  for (std::size_t i = 0; i < kBlocks; ++i) free_.put({});
  thread_ = std::jthread([this] { run(); });
}

WriteBehind::~WriteBehind() {
  full_.close();
  free_.close();
}

void WriteBehind::run() {
  try {
    while (std::optional<std::vector<std::byte>> block = full_.take()) {
      write_(*block);
      free_.put(std::move(*block));
    }
  } catch (...) {
    failure_ = std::current_exception();
    full_.close();
    free_.close();
  }
}

void WriteBehind::add(std::span<const std::byte> bytes) {
  std::optional<std::vector<std::byte>> block = free_.take();
  if (!block) finish();  // the thread gave up
  block->resize(bytes.size());
  copy_parallel(bytes, std::span<std::byte>(*block));
  if (!full_.put(std::move(*block))) finish();
}

void WriteBehind::finish() {
  full_.close();
  thread_.join();
  if (failure_) std::rethrow_exception(failure_);
}

namespace {

/// Traces all rays of a file; `write` gets the bytes of the result.
FileTrace trace_to(Engine& engine, RayFile file, const WriteBehind::Write& write, const Query& query,
                   const Progress& progress) {
  FileTrace result;
  result.rays = file.count();
  const std::string start = hits_start(result.rays);
  ReadAhead in(std::move(file));
  WriteBehind out(write);
  out.add(std::as_bytes(std::span(start)));
  RayStream stream{
      .most = result.rays,
      .next =
          [&](std::span<Ray> room) {
            const std::size_t count = in.next(room);
            if (result.ray_class.empty() && query.method == kAuto && count)
              result.ray_class = ray_class(room.first(count));
            return count;
          },
      .take =
          [&](std::span<const Hit> hits) {
            result.hits += count_hits(hits);
            out.add(std::as_bytes(hits));
          },
      .progress = [&](std::uint64_t done) { progress(double(done) / double(result.rays)); },
  };
  engine.tracer().variant(query);  // an unknown method is an error even without rays
  result.times = engine.tracer().trace(stream, query);
  out.finish();
  result.dead = in.dead();
  return result;
}

}  // namespace

FileTrace trace_file(Engine& engine, RayFile file, const std::string& to, const Query& query,
                     const Progress& progress) {
  if (const std::optional<int> stream = descriptor_of(to))
    return trace_to(
        engine, std::move(file), [&](std::span<const std::byte> bytes) { write_stream(*stream, bytes); }, query,
        progress);
  FileTrace result;
  write_atomically(to, [&](OutputFile& out) {
    const auto write = [&](std::span<const std::byte> bytes) { out.write(bytes.data(), bytes.size()); };
    result = trace_to(engine, std::move(file), write, query, progress);
  });
  return result;
}

}  // namespace ballot::cli
