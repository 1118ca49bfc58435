// Records and bindings that the overlay painter of a window shares with its shaders.
#ifndef BALLOT_PAINT_H
#define BALLOT_PAINT_H

#include "layout.h"

#define BIND_VERTICES 0
#define BIND_INDICES 1
#define BIND_ATLAS 2

// A corner of a triangle: its position in window pixels from the top left, its place in the atlas in [0, 1], and its
// sRGB colour with red in the lowest byte.
struct PaintVertex {
  float x, y;
  float u, v;
  uint color;
};

struct PaintPush {
  float scale_x, scale_y;  // from window pixels to clip space
  uint first_vertex;
};

#ifdef __cplusplus
namespace ballot {
BALLOT_RECORD(PaintVertex, 20);
BALLOT_RECORD(PaintPush, 12);
}  // namespace ballot
#endif
#endif  // BALLOT_PAINT_H
