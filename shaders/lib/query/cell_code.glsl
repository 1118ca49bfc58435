// Cells of a grid by their Morton codes.

// Spreads the lower ten bits, so that two bits are free behind each.
uvec3 spread(uvec3 x) {
  x = (x | x << 16) & 0x030000FFu;
  x = (x | x << 8) & 0x0300F00Fu;
  x = (x | x << 4) & 0x030C30C3u;
  return (x | x << 2) & 0x09249249u;
}

// Returns the code of a cell by its numbers along the axes, at most ten bits each.
uint code_of(uvec3 cell) {
  uvec3 s = spread(cell);
  return s.x << 2 | s.y << 1 | s.z;
}

uint gathered(uint x) {
  x &= 0x09249249u;
  x = (x | x >> 2) & 0x030C30C3u;
  x = (x | x >> 4) & 0x0300F00Fu;
  x = (x | x >> 8) & 0x030000FFu;
  return (x | x >> 16) & 0x3FFu;
}
uvec3 cell_of(uint code) { return uvec3(gathered(code >> 2), gathered(code >> 1), gathered(code)); }

// Returns what the cell of a code is in the words of a level.
#define CELL_IN(words, code) (words[(code) >> 4] >> 2u * ((code)&15u) & 3u)
