// How kernels are given arrays. Internal to engine/tree.
#pragma once

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

}  // namespace ballot
