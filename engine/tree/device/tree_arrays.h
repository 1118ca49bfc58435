// How kernels are given arrays. Internal to engine/tree/device.
#pragma once

#include "engine/gpu/buffer.h"
#include "engine/tree/device/tree_access.h"

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
