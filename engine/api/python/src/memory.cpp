// Memory of large results. Pages that the system gives for the first time cost as much as writing results to them, so
// the memory of arrays that Python has let go of is kept for the next ones.
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <map>
#include <mutex>

#include "common.h"

#include <thread>

namespace ballot::python {

namespace {

constexpr std::size_t kMostKept = std::size_t(1) << 30;  // and no more than a 32nd of the machine's memory
constexpr std::size_t kPage = std::size_t(2) << 20;      // sizes are multiples of a huge page

/// Blocks of memory by size. Thread-safe.
class ResultMemory {
 public:
  /// Returns a block of at least this size, and its size.
  std::pair<void*, std::size_t> take(std::size_t bytes) {
    const std::size_t size = (bytes + kPage - 1) / kPage * kPage;
    const std::lock_guard lock(mutex_);
    const auto found = free_.lower_bound(size);
    if (found != free_.end() && found->first <= 2 * size) {
      const std::pair<void*, std::size_t> block{found->second, found->first};
      kept_ -= found->first;
      free_.erase(found);
      return block;
    }
    void* block = std::aligned_alloc(kPage, size);
    if (!block) throw std::bad_alloc();
    madvise(block, size, MADV_HUGEPAGE);  // fewer faults; a kernel without them refuses, which does no harm
    return {block, size};
  }

  /// Keeps a block for the next arrays, unless much is kept already.
  void give(void* block, std::size_t size) noexcept {
    const std::lock_guard lock(mutex_);
    if (kept_ + size > most_) {
      std::free(block);
      return;
    }
    free_.emplace(size, block);
    kept_ += size;
  }

 private:
  std::mutex mutex_;
  std::multimap<std::size_t, void*> free_;
  std::size_t kept_ = 0;
  const std::size_t most_ =
      std::min(kMostKept, std::size_t(sysconf(_SC_PHYS_PAGES)) * std::size_t(sysconf(_SC_PAGESIZE)) / 32);
};

/// Returns the memory of the process. It is never destroyed, as arrays may outlive all else.
ResultMemory& memory() {
  static auto* const memory = new ResultMemory;
  return *memory;
}

}  // namespace

ResultBlock::ResultBlock(std::size_t bytes) { std::tie(data_, size_) = memory().take(bytes); }

ResultBlock::~ResultBlock() {
  if (data_) memory().give(data_, size_);
}

void copy_memory(std::byte* to, const void* from, std::size_t bytes) {
  constexpr std::size_t kPart = 1 << 21, kMostThreads = 8;
  const std::size_t threads = std::min({bytes / kPart, kMostThreads, std::size_t(std::thread::hardware_concurrency())});
  const std::size_t part = threads ? bytes / threads : 0;
  std::vector<std::jthread> others;
  for (std::size_t i = 1; i < threads; ++i)
    others.emplace_back([=] { std::memcpy(to + i * part, static_cast<const std::byte*>(from) + i * part, part); });
  const std::size_t rest = threads * part;
  std::memcpy(to, from, threads ? part : 0);
  if (bytes > rest) std::memcpy(to + rest, static_cast<const std::byte*>(from) + rest, bytes - rest);
}

void ResultBlock::make_room(std::size_t bytes, std::size_t used) {
  if (bytes <= size_) return;
  ResultBlock larger(std::max(bytes, 2 * size_));
  copy_memory(static_cast<std::byte*>(larger.data_), data_, used);
  std::swap(data_, larger.data_), std::swap(size_, larger.size_);
}

nb::capsule ResultBlock::owner() && {
  return nb::capsule(new ResultBlock(std::move(*this)), [](void* p) noexcept { delete static_cast<ResultBlock*>(p); });
}

void bind_memory(nb::module_& m) {
  m.def("result_bytes", [](std::size_t bytes) {
    ResultBlock block(bytes);
    void* data = block.data();
    return nb::ndarray<nb::numpy, std::uint8_t>(data, {bytes}, std::move(block).owner());
  });
}

}  // namespace ballot::python
