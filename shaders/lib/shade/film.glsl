// The position of a ray in the picture. The order of rays is described in shaders/shared/render.h.

// Packs the bits at even positions of x together.
uint even_bits(uint x) {
  x &= 0x55555555u;
  x = (x | x >> 1) & 0x33333333u;
  x = (x | x >> 2) & 0x0F0F0F0Fu;
  x = (x | x >> 4) & 0x00FF00FFu;
  return (x | x >> 8) & 0x0000FFFFu;
}

uvec2 listed_pixel(uint word) { return uvec2(word & 0xFFFFu, word >> 16); }

uvec2 pixel_of(uint ray, uint width) {
  uint tiles_x = (width + TILE_SIZE - 1u) / TILE_SIZE;
  uint tile = ray / (TILE_SIZE * TILE_SIZE), inner = ray % (TILE_SIZE * TILE_SIZE);
  return uvec2(tile % tiles_x, tile / tiles_x) * TILE_SIZE + uvec2(even_bits(inner), even_bits(inner >> 1));
}
