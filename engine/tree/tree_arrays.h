// What the arrays of single trees and of forests share. Internal to engine/tree.
#pragma once

#include <atomic>
#include <cstdint>

#include "engine/tree/tree_access.h"
#include "engine/vk/buffer.h"

namespace ballot {

inline Access access_for(Fetch fetch) {
  switch (fetch) {
    case Fetch::Texel:
      return Access::Texel;
    case Fetch::Reference:
      return Access::Address;
    case Fetch::Storage:
      break;
  }
  return Access::Storage;
}

/// Returns a number that no other tree of the process has or had.
inline std::uint64_t next_generation() {
  static std::atomic<std::uint64_t> last{0};
  return ++last;
}

}  // namespace ballot
