// Morton (Z) order.
#pragma once

#include <cstdint>

namespace ballot {

/// Returns the bits 0, 2, 4, ... of x, moved together. This is the column of Morton number x; even_bits(x >> 1) is its
/// row.
constexpr std::uint32_t even_bits(std::uint32_t x) {
  x &= 0x55555555u;
  x = (x | x >> 1) & 0x33333333u;
  x = (x | x >> 2) & 0x0F0F0F0Fu;
  x = (x | x >> 4) & 0x00FF00FFu;
  return (x | x >> 8) & 0x0000FFFFu;
}

}  // namespace ballot
