// Arrays of rows of numbers. Internal to the readers of arrays.
#pragma once

#include <cstddef>
#include <cstdint>

#include "engine/files/npy_file.h"

namespace ballot {

/// An array of rows of numbers, as a header describes it.
struct Rows {
  std::uint64_t count = 0, width = 0;
  char kind = 0;          // f, i, u
  std::size_t bytes = 0;  // of a number

  bool are_floats() const { return kind == 'f' && (bytes == 4 || bytes == 8); }
  bool are_integers() const { return kind == 'i' || kind == 'u'; }
};

/// Returns the rows of an array: (n, width), or (n, 3, 3) for a width of 9. Width 0: it is no array of rows.
Rows rows_of(const NpyFile& file);

}  // namespace ballot
