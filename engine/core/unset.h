// Arrays whose memory is first touched by those who fill them.
#pragma once

#include <sys/mman.h>

#include <cstdlib>
#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace ballot {

/// An allocator that leaves new elements of trivial types unset, and asks for huge pages for large arrays: the system
/// takes longer to give memory in small ones than most steps take to fill it.
template <class T>
struct UnsetAllocator : std::allocator<T> {
  T* allocate(std::size_t count) {
    if (!is_large(count)) return std::allocator<T>::allocate(count);
    const std::size_t bytes = (count * sizeof(T) + kHugePage - 1) / kHugePage * kHugePage;
    void* const at = std::aligned_alloc(kHugePage, bytes);
    if (!at) throw std::bad_alloc();
    ::madvise(at, bytes, MADV_HUGEPAGE);  // a system without them gives small ones
    return static_cast<T*>(at);
  }
  void deallocate(T* at, std::size_t count) {
    if (is_large(count))
      std::free(at);
    else
      std::allocator<T>::deallocate(at, count);
  }
  template <class U>
  void construct(U* at) {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Args>
  void construct(U* at, Args&&... args) {
    ::new (static_cast<void*>(at)) U(std::forward<Args>(args)...);
  }

 private:
  static constexpr std::size_t kHugePage = 2 << 20, kLarge = 4 * kHugePage;
  static bool is_large(std::size_t count) {
    return count >= kLarge / sizeof(T) && count < static_cast<std::size_t>(-1) / 2 / sizeof(T);
  }
};

/// A vector whose resize() leaves new elements unset. The system gives a large array its memory page by page where it
/// is first written; so all cores that fill it take part in that too.
template <class T>
using UnsetVector = std::vector<T, UnsetAllocator<T>>;

}  // namespace ballot
