// A parallel loop over chunks.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstring>
#include <exception>
#include <functional>
#include <mutex>
#include <span>
#include <type_traits>
#include <vector>

namespace ballot {

/// Calls work() here and at the same time in up to `helpers` threads that the process keeps for this. Returns when all
/// calls have returned. `work` must not throw. Thread-safe, and may be nested: where no thread is free, `work` runs
/// here alone.
void run_together(std::size_t helpers, const std::function<void()>& work);

/// Returns the number of threads that the machine runs at once, at least 1.
std::size_t core_count();

/// Calls work(begin, end) once for every chunk of [0, count), from as many threads as the machine has cores. `work`
/// must be thread-safe. Returns when all chunks are done. After an exception no new chunk is begun, and the first one
/// is rethrown.
template <class Work>
void for_chunks(std::size_t count, std::size_t chunk, const Work& work) {
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex mutex;
  const auto run = [&] {
    try {
      for (std::size_t begin = next.fetch_add(chunk); begin < count; begin = next.fetch_add(chunk))
        work(begin, std::min(begin + chunk, count));
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
      next = count;
    }
  };
  const std::size_t chunks = (count + chunk - 1) / chunk;
  if (chunks > 1)
    run_together(std::min(chunks, core_count()) - 1, run);
  else
    run();
  if (failure) std::rethrow_exception(failure);
}

/// Returns what all chunks of [0, count) come to together: of(begin, end) of each, joined to `start` by join(a, b) in
/// their order. Runs as for_chunks() does.
template <class T, class Of, class Join>
T joined_chunks(std::size_t count, std::size_t chunk, T start, const Of& of, const Join& join) {
  std::vector<T> parts((count + chunk - 1) / chunk, start);
  for_chunks(count, chunk, [&](std::size_t begin, std::size_t end) { parts[begin / chunk] = of(begin, end); });
  for (const T& part : parts) start = join(start, part);
  return start;
}

/// Copies an array, by several threads if it is large. The spans have equal sizes and do not overlap.
template <class T>
void copy_parallel(std::span<const T> from, std::span<T> to) {
  static_assert(std::is_trivially_copyable_v<T>);
  constexpr std::size_t kChunk = (1u << 20) / sizeof(T);
  const auto copy = [&](std::size_t begin, std::size_t end) {
    std::memcpy(to.data() + begin, from.data() + begin, (end - begin) * sizeof(T));
  };
  if (from.size() > kChunk)
    for_chunks(from.size(), kChunk, copy);
  else if (!from.empty())
    copy(0, from.size());
}

}  // namespace ballot
