// Arrays whose memory is first touched by those who fill them.
#pragma once

#include <memory>
#include <new>
#include <utility>
#include <vector>

namespace ballot {

/// An allocator that leaves new elements of trivial types unset.
template <class T>
struct UnsetAllocator : std::allocator<T> {
  template <class U>
  void construct(U* at) {
    ::new (static_cast<void*>(at)) U;
  }
  template <class U, class... Args>
  void construct(U* at, Args&&... args) {
    ::new (static_cast<void*>(at)) U(std::forward<Args>(args)...);
  }
};

/// A vector whose resize() leaves new elements unset. The system gives a large array its memory page by page where it
/// is first written; so all cores that fill it take part in that too.
template <class T>
using UnsetVector = std::vector<T, UnsetAllocator<T>>;

}  // namespace ballot
